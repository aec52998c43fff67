// A capture: photographs, and of what camera and light each is.
//
// On disk a folder with transforms.json, a superset of what nerfstudio and Blender's exporters write:
//
//   { "color_space": "linear" or "srgb", or "response": { "r", "g", "b": 256 exposures },
//     "geometry": "mesh.ply", "origin": [x, y, z], "calibration": { notes for people },
//     "w", "h", "fl_x", "fl_y", "cx", "cy": pixels, "camera_angle_x", "camera_angle_y": radians, "x_fov",
//     "y_fov": degrees, "k1", "k2", "p1", "p2",
//     "camera_model": "pinhole" or "orthographic" with "ortho_height", scene units,
//     "lights": [{ "name", "cluster", "type": "directional", "direction", "irradiance": [r, g, b],
//                  "irradiance_gradient": [x, y, z] },
//                { "name", "cluster", "type": "point", "position", "intensity": [r, g, b] }],
//     "frames": [{ "file_path", "layer", "alpha_layer", "mask_path", "exposure", "split": "train" or "test",
//                  "camera", "light", "transform_matrix": camera to world, 4 rows, OpenGL's axes }] }
//
// A frame can have its own lens, and instead of "light" its own "pl_pos", "pl_intensity". Required are
// file_path, transform_matrix and one of fl_x, camera_angle_x, x_fov, ortho_height. capture_keys.h says what
// becomes of other keys.
#pragma once

#include "srf/capture/camera.h"
#include "srf/capture/rig.h"
#include "srf/image/response.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::capture {

enum class ColorSpace { linear, srgb };
enum class Split { train, test };

// A place photographs were taken from. Views can share a camera identity: a gantry that comes back to a
// position does so with a small error.
struct View {
  std::string identity; // "camera" of the file; without it, the path of the view's first picture
  Camera<AcquisitionSpace> camera;
};

// One more picture of the same view and light, exposed for another time.
struct Exposure {
  std::filesystem::path picture = {};
  std::string layer = {}, alphaLayer = {};
  double exposure = 1; // seconds

  friend bool operator==(const Exposure&, const Exposure&) = default;
};

// One photograph: a picture, or a bracket of pictures that differ in exposure. Paths are relative to the
// capture's folder.
struct Frame {
  size_t view = 0;                  // index into Capture::views
  std::optional<size_t> light = {}; // index into Capture::lights; none: fixed illumination
  std::filesystem::path picture = {};
  std::string layer = {},
              alphaLayer = {};     // channel prefixes in a multi-layer EXR; alphaLayer empty: that of layer
  double exposure = 1;             // seconds; stored values are divided by it
  std::filesystem::path mask = {}; // empty: none
  Split split = Split::train;
  std::vector<Exposure> further = {}; // the rest of the bracket; no two exposures of a bracket are equal

  friend bool operator==(const Frame&, const Frame&) = default;
};

struct Capture {
  std::filesystem::path file;              // the JSON file
  std::optional<ColorSpace> colorSpace;    // of the pictures; none: as each file says (picture_encoding.h)
  std::optional<image::Response> response; // instead of colorSpace: all pictures have 8 bits of this camera
  std::filesystem::path geometry;          // a mesh, relative to the folder; empty: none
  // Original coordinates of the point from which cameras and lights count. Mesh files, also those given
  // beside the capture, stay in original coordinates: readMesh() subtracts it.
  Vec3<double> origin = {0, 0, 0};
  std::vector<Light> lights;
  std::vector<View> views;
  std::vector<Frame> frames; // all with a light, or none; no two of train share view and light
  // What was estimated from the photographs, and how: { "light_strengths": "estimated from ..." }. For
  // people.
  std::map<std::string, std::string> calibration;
  std::optional<double> time;     // of all frames, in the file's own measure; none: not said
  std::vector<std::string> notes; // what a user should know of how the file was understood; not written

  std::filesystem::path folder() const { return file.parent_path(); }
};

// The pictures of a frame in the order of the file: its own, and those further ones.
std::vector<Exposure> bracketOf(const Frame& frame);

// A capture that somebody else has made names files of its own folder; whether it may name others, by "..",
// an absolute path or a link, is for the user to say. Those of a capture that is being made (unmade) stay
// inside and need not be there yet.
enum class PathRule { inside, anywhere, unmade };

// Reads a folder's transforms.json, or a JSON file of that form. Checks everything but pixels: that the files
// named are there and inside the folder, lights known and unit, poses rigid. Pictures are opened only where
// the file does not say their size. Throws Error with file, field, expected and found.
Capture readCapture(const std::filesystem::path& folderOrJson, PathRule paths = PathRule::inside);
// The same from the text of the file.
Capture parseCapture(std::string_view json, const std::filesystem::path& file,
                     PathRule paths = PathRule::inside);

// The frames wanted, with the views and lights they use, in the same order.
Capture subset(const Capture& capture, const std::function<bool(const Frame&)>& wanted);

} // namespace surflect::capture
