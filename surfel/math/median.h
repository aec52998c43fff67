// Median of numbers.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <vector>

namespace surflect {

// Middle one of the sorted numbers, the upper one if their count is even. There must be at least one.
inline double median(std::vector<double> values) {
  assert(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

} // namespace surflect
