#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace surflect {

// 0, 1, .. count - 1
inline std::vector<uint32_t> upTo(size_t count) {
  std::vector<uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  return numbers;
}

} // namespace surflect
