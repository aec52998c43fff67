// Texel quotas: how a lumigraph gets the resolution of a surface light field.
//
// [Azuma 1999, §4.1] A slab shows one of six sides, so it gets a sixth of the texels that the surface light
// field spends on all; less where those are redundant, as texels of overlapping regions are.
#pragma once

#include <cassert>
#include <cmath>
#include <cstddef>

namespace surflect::lumigraph {

// Texels for one slab, whose six together match a surface light field of the given texels, stored r times
// each. [Azuma 1999, §4.1]: 33,235,488 texels and a redundancy of 2 give 2,769,624.
inline size_t slabQuota(size_t surfaceTexels, double redundancy) {
  assert(redundancy >= 1);
  return static_cast<size_t>(std::floor(static_cast<double>(surfaceTexels) / (6 * redundancy)));
}

// Side, in texels, of the square pictures of nodes x nodes cameras that come nearest to the quota of a slab.
// [Azuma 1999, §4.2.1]: 238 for 7 x 7, 416 for 4 x 4. For 5 x 5 it is 333, where Fig. 4.9 has 334.
inline int pictureSide(size_t quota, int nodes) {
  assert(nodes > 0);
  return static_cast<int>(std::lround(std::sqrt(static_cast<double>(quota)) / nodes));
}

} // namespace surflect::lumigraph
