// Keys of transforms.json in all dialects, and their treatment: Blender's exporters and NeRF-synthetic,
// instant-ngp, nerfstudio, NRHints and GS3, NeuS2, D-NeRF, and our own.
#pragma once

#include "srf/capture/camera.h"
#include "srf/capture/json_fields.h"
#include "srf/capture/rig.h"
#include "srf/image/image_file.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace surflect::capture {

enum class KeyPlace { capture, light, frame };

// Collects the unknown keys of a description.
class UnknownKeys {
public:
  void add(const std::string& key, KeyPlace place) { ++counts_[{key, place}]; }
  // '2 keys are not known and passed over: "foo", "bar" (in 12 frames)'; empty if there are none.
  std::optional<std::string> note() const;

private:
  std::map<std::pair<std::string, KeyPlace>, size_t> counts_;
};

// Counts unknown keys. Throws Error for one that would change the meaning and is not supported.
void checkKeys(const Json& object, KeyPlace place, UnknownKeys& unknown);

// Lens keys in the JSON of a capture, for each frame and as defaults for all frames.

// Pixels and radians; orthoHeight in scene units. A focal length overrides an angle of the same axis.
struct LensFields {
  std::optional<Lens::Model> model = {};
  std::optional<int> width = {}, height = {};
  std::optional<double> focalX = {}, focalY = {}, angleX = {}, angleY = {}, orthoHeight = {};
  std::optional<double> centerX = {}, centerY = {}, k1 = {}, k2 = {}, k3 = {}, p1 = {}, p2 = {};
};

LensFields readLensFields(const Json& object);

// Fields of a frame, with defaults from the capture. An angle in the frame also replaces the capture's focal
// length, and a horizontal angle also the vertical one.
LensFields inherit(LensFields frame, const LensFields& capture);

// Fills in a missing size from the picture. A stated size may differ from the picture's if the shape is
// equal, because pictures may be reduced copies.
LensFields withSize(LensFields lens, image::PictureSize picture);

// Focal length by the angle, if it differs from the stated one; empty if they agree or one is missing.
std::optional<double> otherFocalLength(std::optional<double> focal, std::optional<double> angle, int size);

// Lens from fields with width and height. Without a vertical focal length or angle pixels are square. Throws
// Error with the field that is missing.
Lens lensOf(const LensFields& fields);

// Lights in the JSON of a capture: listed by name, or written into every frame.
Light readLight(const Json& value);

// Lights of a capture, found by name or by value.
class LightList {
public:
  // Throws Error if the name exists.
  size_t add(Light light);
  // Light of the name in `value`.
  size_t named(const Json& value) const;
  // Light that relighting sets write into a frame as "pl_pos" and "pl_intensity"; equal ones are one light.
  std::optional<size_t> ofFrame(const Json& frame, size_t frameIndex);

  std::vector<Light> take() && { return std::move(lights_); }

private:
  using PointKey = std::array<double, 6>; // position and intensity

  static PointKey keyOf(const PointLight& light);

  std::vector<Light> lights_;
  std::map<std::string, size_t> byName_;
  std::map<PointKey, size_t> byPoint_;
};

// Orthonormalises rotations of a file whose digits were rounded or that include a scale.

// Orthonormalises the rotations of one file, and counts its changes.
class RoundedRotations {
public:
  // Nearest rotation to a finite matrix whose entries were rounded to three decimals or more. Throws Error
  // for a reflection, scale or shear.
  Mat3<double> nearest(const Mat3<double>& matrix);
  // Nearest rotation to that of a camera-to-world matrix, which may be scaled: its columns are the camera's
  // axes, so rays keep their directions.
  Mat3<double> nearestUnscaled(const Mat3<double>& worldFromCamera);
  // Counts a rotation that was already orthonormalised, for notes().
  void count(double deviation);

  // Notes for the user: number of rotations off by more than 1e-4, and number of scaled ones.
  std::vector<std::string> notes() const;

private:
  size_t rounded_ = 0, scaled_ = 0;
  double largestDeviation_ = 0;
  double leastScale_ = std::numeric_limits<double>::infinity(), mostScale_ = 0;
};

// Pose in a camera-to-world matrix of four rows, its axes as in camera.h; its rotation is made orthonormal.
Rigid<CameraSpace, AcquisitionSpace> readPose(const Json& value, RoundedRotations& rotations);

} // namespace surflect::capture
