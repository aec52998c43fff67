// A capture: photographs with the camera and light of each.
//
// On disk it is a folder with transforms.json, a superset of the format of nerfstudio and Blender's
// exporters:
//
//   { "color_space": "linear" or "srgb", or "response": { "r", "g", "b": 256 exposures },
//     "geometry": "mesh.ply", "origin": [x, y, z], "calibration": { notes for people },
//     "w", "h", "fl_x", "fl_y", "cx", "cy": pixels, "camera_angle_x", "camera_angle_y": radians, "x_fov",
//     "y_fov": degrees, "k1", "k2", "k3", "p1", "p2",
//     "camera_model": "pinhole" or "orthographic" with "ortho_height", scene units,
//     "lights": [{ "name", "cluster", "type": "directional", "direction", "irradiance": [r, g, b],
//                  "irradiance_gradient": [x, y, z] },
//                { "name", "cluster", "type": "point", "position", "intensity": [r, g, b] }],
//     "frames": [{ "file_path", "layer", "alpha_layer", "mask_path", "exposure", "split": "train" or "test",
//                  "camera", "light", "transform_matrix": camera to world, 4 rows, OpenGL's axes }] }
//
// A frame may have its own lens, and its own "pl_pos" and "pl_intensity" instead of "light". Required are
// file_path, transform_matrix and one of fl_x, camera_angle_x, x_fov, ortho_height. Other keys:
// capture_keys.h.
#pragma once

#include "srf/capture/camera.h"
#include "srf/capture/rig.h"
#include "srf/image/bracket.h"
#include "srf/image/image_file.h"

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace surflect::capture {

enum class ColorSpace { linear, srgb };
enum class Split { train, test };

// A camera pose. Views may share an identity: a gantry that returns to a position does so with a small error.
struct View {
  std::string identity; // "camera" in the file; default: path of the view's first picture, no extension
  Camera<AcquisitionSpace> camera;
};

// A further picture of a view and light, with another exposure time.
struct Exposure {
  std::filesystem::path picture = {};
  std::string layer = {}, alphaLayer = {};
  double exposure = 1; // seconds

  friend bool operator==(const Exposure&, const Exposure&) = default;
};

// One photograph: a picture, or a bracket of pictures with different exposures. Paths are relative to the
// capture's folder.
struct Frame {
  size_t view = 0;                  // index into Capture::views
  std::optional<size_t> light = {}; // index into Capture::lights; none: fixed illumination
  std::filesystem::path picture = {};
  std::string layer = {},
              alphaLayer = {};     // channel prefixes in a multi-layer EXR; an empty alphaLayer means `layer`
  double exposure = 1;             // seconds; stored values are divided by it
  std::filesystem::path mask = {}; // empty: none
  Split split = Split::train;
  std::vector<Exposure> further = {}; // other pictures of the bracket; all exposures of a bracket differ

  friend bool operator==(const Frame&, const Frame&) = default;
};

struct Capture {
  std::filesystem::path file;              // the JSON file
  std::optional<ColorSpace> colorSpace;    // of all pictures; none: as each file states (photograph.h)
  std::optional<image::Response> response; // replaces colorSpace: all pictures have 8 bits and this response
  std::filesystem::path geometry;          // mesh file, relative to the folder; empty: none
  // Origin of cameras and lights in original coordinates. Mesh files keep original coordinates; readMesh()
  // subtracts the origin.
  Vec3<double> origin = {0, 0, 0};
  std::vector<Light> lights;
  std::vector<View> views;
  std::vector<Frame> frames; // either all have a light, or none; training frames differ in view or light
  // Notes for people: what was estimated from the photographs, and how, as { "light_strengths": "estimated
  // from ..." }.
  std::map<std::string, std::string> calibration;
  std::optional<double> time;     // of all frames, in the file's unit; none: not stated
  std::vector<std::string> notes; // notes for the user on how the file was understood; not written

  std::filesystem::path folder() const { return file.parent_path(); }
};

// Pictures of a frame in file order: its own, then `further`.
std::vector<Exposure> bracketOf(const Frame& frame);

// Rule for the files that a capture names. inside: in the capture's folder; anywhere: also by "..", absolute
// paths and links; unmade: inside, but files need not exist yet (a capture that is being written).
enum class PathRule { inside, anywhere, unmade };

// Reads a folder's transforms.json, or a JSON file of that form. Checks everything but pixels: files exist
// and are inside the folder, lights are known and unit, poses rigid. Opens pictures only if the file does not
// state their size. Throws Error with file, field, expected and found.
Capture readCapture(const std::filesystem::path& folderOrJson, PathRule paths = PathRule::inside);
// Reads a capture from the text of the file.
Capture parseCapture(std::string_view json, const std::filesystem::path& file,
                     PathRule paths = PathRule::inside);

// Point nearest to the viewing axes of all views, in least squares: where the object most likely is. The
// origin without views.
Vec3<double> middleOfAxes(std::span<const View> views);

// Frames that satisfy `wanted`, with the views and lights they use, in the same order.
Capture subset(const Capture& capture, const std::function<bool(const Frame&)>& wanted);

// Files that a capture names, which must be in its own folder unless the user allows others.

// Paths are relative to the folder and lexically normal. Files that were found are remembered, because many
// frames may share one.
class CaptureFiles {
public:
  CaptureFiles(std::filesystem::path folder, PathRule rule) : folder_(std::move(folder)), rule_(rule) {}

  // Returns whether the rule allows the path: it stays inside the folder (links are not followed), or may lie
  // anywhere.
  bool mayName(const std::filesystem::path& path) const;
  // Returns whether the path is a regular file, or need not exist yet. Throws Error if a link leads out of
  // the folder.
  bool isThere(const std::filesystem::path& path);
  image::PictureSize sizeOf(const std::filesystem::path& picture);
  // The only picture of this name with an extension.
  std::optional<std::filesystem::path> pictureCalled(const std::filesystem::path& path) const;
  // " (images/a.png is there: letter case or accents differ)", about a path without file; empty if no file is
  // like it.
  std::string similarTo(const std::filesystem::path& path) const;

  // Suffix of messages about a path that leaves the folder.
  static constexpr const char* hint = " (--allow-outside lifts this)";

private:
  bool isFileInside(const std::filesystem::path& path) const;

  std::filesystem::path folder_;
  PathRule rule_;
  std::set<std::filesystem::path> found_;
  std::map<std::filesystem::path, image::PictureSize> sizes_;
};

// Groups the frames of a capture into views, and further exposures into photographs.
class ViewGrouping {
public:
  // Adds a frame to its view, as a photograph, or as a further exposure of the photograph of that light and
  // split. A view may have several test photographs. A second training photograph becomes a view of its own,
  // as if taken by another camera. Frames without a camera's name share a view if pose and lens agree.
  void add(Capture& capture, Frame frame, const std::optional<std::string>& cameraName,
           const Camera<AcquisitionSpace>& camera);

  // Notes for the user: photographs that repeat view and light of another, frames listed twice, and frames
  // whose picture is that of another camera or light.
  std::vector<std::string> notes() const;

private:
  // The camera's name, if any, then the numbers of lens and pose.
  using ViewKey = std::pair<std::optional<std::string>, std::array<double, 24>>;

  // Last photograph of a pose, light and split, and the view it belongs to.
  struct Shot {
    size_t copy = 0, frame = 0;
  };

  static ViewKey keyOf(const std::optional<std::string>& cameraName, const Camera<AcquisitionSpace>& camera);

  std::map<ViewKey, std::vector<size_t>> views_;                           // of one pose, in file order
  std::map<std::tuple<size_t, std::optional<size_t>, Split>, Shot> shots_; // by the pose's first view
  // First view of the pose, and light, of each picture and layer.
  std::map<std::pair<std::filesystem::path, std::string>, std::pair<size_t, std::optional<size_t>>> shown_;
  size_t repeated_ = 0, listedTwice_ = 0, shared_ = 0;
  std::string firstRepeated_, firstShared_;
};

} // namespace surflect::capture
