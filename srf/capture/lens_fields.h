// What the JSON of a capture says about lenses: each frame for itself, and once for all that are silent.
#pragma once

#include "srf/capture/camera.h"

#include <optional>

namespace surflect {

// Pixels and radians, orthoHeight in scene units.
struct LensFields {
  std::optional<Lens::Model> model = {};
  std::optional<int> width = {}, height = {};
  std::optional<double> focalX = {}, focalY = {}, angleX = {}, orthoHeight = {};
  std::optional<double> centerX = {}, centerY = {}, k1 = {}, k2 = {}, p1 = {}, p2 = {};
};

// What the frame says, and where it is silent what the capture says. An angle in the frame is not silent
// about the focal length.
LensFields inherit(LensFields frame, const LensFields& capture);

// Width and height are given. Throws Error with the field where what the model needs is missing.
Lens lensOf(const LensFields& fields);

} // namespace surflect
