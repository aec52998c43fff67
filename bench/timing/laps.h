// How long a piece of work takes, measured several times.
#pragma once

#include <functional>
#include <span>

namespace surflect::bench {

// One measurement.
struct Lap {
  double seconds = 0, processorSeconds = 0; // of the clock; of all threads together, whatever else is running
};
Lap lapOf(const std::function<void()>& work);

struct Times {
  double best = 0, median = 0; // seconds of the clock
  double processor = 0;        // of all threads together, median
};
// Of at least one measurement.
Times timesOf(std::span<const Lap> laps);

} // namespace surflect::bench
