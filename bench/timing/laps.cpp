#include "bench/timing/laps.h"

#include "surfel/base/processor_time.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <vector>

namespace surflect::bench {

Lap lapOf(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  const double processorStart = processorSeconds();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          processorSeconds() - processorStart};
}

Times timesOf(std::span<const Lap> laps) {
  assert(!laps.empty());
  const auto sorted = [&](double Lap::*time) {
    std::vector<double> times;
    for (const Lap& lap : laps) times.push_back(lap.*time);
    std::ranges::sort(times);
    return times;
  };
  const auto seconds = sorted(&Lap::seconds), processor = sorted(&Lap::processorSeconds);
  return {seconds.front(), seconds[laps.size() / 2], processor[laps.size() / 2]};
}

} // namespace surflect::bench
