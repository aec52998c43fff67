// How much longer one piece of work takes than another, both measured by turns.
#pragma once

#include "bench/timing/laps.h"

#include <span>

namespace surflect::bench {

// `error` is the standard error of the median.
struct TimeRatio {
  double median = 1, error = 0;
};

// Of processor time, turn by turn, so that what slows down the machine for a while counts on both sides. As
// many laps of one as of the other, at least one; of one lap no error is known and it is 0.
TimeRatio timeRatio(std::span<const Lap> over, std::span<const Lap> under);

} // namespace surflect::bench
