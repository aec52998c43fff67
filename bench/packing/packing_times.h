// How fast blocks of 8x8 texels under 60 lights are compressed on one thread, beside Eigen's singular value
// decomposition alone of the same numbers.
#pragma once

#include "bench/timing/laps.h"

#include <cstddef>

namespace surflect::bench {

struct PackingTimes {
  size_t blocks = 0;
  double rank = 0, bytes = 0; // of a block, in the mean
  double error = 0;           // RMS, of what blocks hold
  double overBest = 0;        // the same of the best approximation of each block's rank
  // Multiply-adds count two. The least that a block takes by what is known: the scalar products of its
  // columns, each pair once; of its strongest r directions r images, and r coefficients for each light.
  double operations = 0;
  Times ours, svd; // of all blocks, in turns
};

// Throws Error where blocks err half as much again as the best of their rank would.
PackingTimes timePacking(int rounds);

} // namespace surflect::bench
