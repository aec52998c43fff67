// A light on a surfel, and the captured lights that are blended for it. Plain structs: kernels read them.
#pragma once

#include "surfel/math/rgb.h"

#include <cstdint>

namespace surflect::codec {

// A captured light, by its column, and how much of it.
struct LightWeight {
  uint32_t light;
  float weight;
};

// Light of one colour, and what answers for it: weights [begin, end).
struct BlendedLight {
  Rgb color;
  uint32_t begin = 0, end = 0;
};

} // namespace surflect::codec
