// How fast the doll of bench/plain_splats is warped on one thread.
#pragma once

#include "bench/timing/laps.h"

#include <cstddef>
#include <string>
#include <vector>

namespace surflect::bench {

// One way of a warp: "differences", five evaluations a surfel as the paper does [Weyrich 2005, Eq. 6];
// "exact", point by point with exact Jacobians; or vector instructions by name.
struct WarpTimes {
  std::string warp, way;
  size_t surfels = 0;
  Times times; // of all of them
};

// A twist and a lattice, all ways of each in turns, differences first. Throws Error where two ways do not
// agree.
std::vector<WarpTimes> timeWarps(int rounds);

} // namespace surflect::bench
