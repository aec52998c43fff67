// What the JSON of a capture says about lenses: each frame for itself, and once for all that are silent.
#pragma once

#include "srf/capture/camera.h"

#include <optional>

namespace surflect::capture {

// Pixels and radians, orthoHeight in scene units. Where an axis has a focal length and an angle, the length
// counts.
struct LensFields {
  std::optional<Lens::Model> model = {};
  std::optional<int> width = {}, height = {};
  std::optional<double> focalX = {}, focalY = {}, angleX = {}, angleY = {}, orthoHeight = {};
  std::optional<double> centerX = {}, centerY = {}, k1 = {}, k2 = {}, p1 = {}, p2 = {};
};

// What the frame says, and where it is silent what the capture says. An angle in the frame is not silent
// about the focal length, nor is a horizontal one about the vertical.
LensFields inherit(LensFields frame, const LensFields& capture);

// Whether two angles in radians are the same but for rounding, to two decimals or to whole degrees.
bool sameAngle(double a, double b);

// The focal length that an angle says where another one is stated; empty where they agree, or one is missing.
std::optional<double> otherFocalLength(std::optional<double> focal, std::optional<double> angle, int size);

// Width and height are given. Without a vertical focal length or angle pixels are square. Throws Error with
// the field where what the model needs is missing.
Lens lensOf(const LensFields& fields);

} // namespace surflect::capture
