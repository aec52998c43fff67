// [Huber 1981] Robust Statistics, §5.1: the median absolute deviation, 1.4826 of which are a standard
// deviation where deviations are normal, and the median's standard error, 1.2533 of the mean's.
#include "bench/timing/time_ratio.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace surflect::bench {

namespace {

double medianOf(std::vector<double> values) {
  std::ranges::sort(values);
  const size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

} // namespace

TimeRatio timeRatio(std::span<const Lap> over, std::span<const Lap> under) {
  assert(over.size() == under.size() && !over.empty());
  std::vector<double> ratios, deviations;
  for (size_t i = 0; i < over.size(); ++i)
    ratios.push_back(over[i].processorSeconds / under[i].processorSeconds);
  const double median = medianOf(ratios);
  for (const double ratio : ratios) deviations.push_back(std::abs(ratio - median));
  return {median, 1.2533 * 1.4826 * medianOf(deviations) / std::sqrt(static_cast<double>(ratios.size()))};
}

} // namespace surflect::bench
