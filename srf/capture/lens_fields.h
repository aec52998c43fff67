// Lens keys in the JSON of a capture, for each frame and as defaults for all frames.
#pragma once

#include "srf/capture/camera.h"
#include "srf/capture/json_fields.h"
#include "srf/image/image_file.h"

#include <optional>

namespace surflect::capture {

// Pixels and radians; orthoHeight in scene units. A focal length overrides an angle of the same axis.
struct LensFields {
  std::optional<Lens::Model> model = {};
  std::optional<int> width = {}, height = {};
  std::optional<double> focalX = {}, focalY = {}, angleX = {}, angleY = {}, orthoHeight = {};
  std::optional<double> centerX = {}, centerY = {}, k1 = {}, k2 = {}, p1 = {}, p2 = {};
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

} // namespace surflect::capture
