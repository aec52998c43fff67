// A light of a view, and what its radiance is multiplied by.
#pragma once

#include "surfel/rgb.h"

#include <cstdint>

namespace surflect {

struct LightWeight {
  uint32_t light = 0; // its column
  Rgb weight;
};

} // namespace surflect
