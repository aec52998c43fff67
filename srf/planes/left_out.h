// Error of photographs that were left out, predicted from the others.
#pragma once

#include "srf/planes/basis.h"
#include "srf/planes/stack.h"
#include "surfel/base/time.h"

#include <vector>

namespace surflect::planes {

// Mean squares of errors, of values from black to white.
struct Errors {
  double linear = 0, srgb = 0; // in linear light, and after the sRGB curve

  double linearDb() const;
  double srgbDb() const;
};

// Predicts the photographs of a few lights, each from planes of all others; samples off the object do not
// count. The planes are not compressed. One entry for each light left out, at most `most`
// of them, spread over the stack's order (withoutPeriod()): lights far apart would be those of the rim alone.
struct LeftOutLight {
  size_t photograph = 0;
  Errors errors;
};
std::vector<LeftOutLight> leaveLightsOut(const Stack& stack, const Samples& samples, float white,
                                         Eigen::Index planes, size_t most, const Progress& progress);

// Mean of mean squares.
Errors meanOf(const std::vector<LeftOutLight>& lights);

} // namespace surflect::planes
