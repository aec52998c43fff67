// Texel quotas: how a lumigraph gets the resolution of a surface light field.
//
// [Azuma 1999, §4.1] A slab shows one of six sides, so it gets a sixth of the texels that the surface light
// field spends on all sides; fewer if these are redundant, as texels of overlapping regions are.
#pragma once

#include <cassert>
#include <cmath>
#include <cstddef>

namespace surflect::lumigraph {

// A sixth of a surface light field's texels, divided by the number of times that it stores each of them.
// [Azuma 1999, §4.1]: 33,235,488 texels, stored twice, give 2,769,624.
inline size_t slabQuota(size_t surfaceTexels, double redundancy) {
  assert(redundancy >= 1);
  return static_cast<size_t>(std::floor(static_cast<double>(surfaceTexels) / (6 * redundancy)));
}

} // namespace surflect::lumigraph
