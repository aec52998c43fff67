// Error of a picture relative to its reference, in linear light.
#pragma once

#include "srf/image/image.h"

namespace surflect::control {

// sqrt(sum |a - b|^2 / sum |b|^2) over red, green and blue of all pixels, for pictures of the same size with
// at least three channels. 0 if both are equal, infinite if only b is black.
double relativeRms(const image::Image& a, const image::Image& b);

} // namespace surflect::control
