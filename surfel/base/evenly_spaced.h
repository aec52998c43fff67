// Even choice of indices.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace surflect {

// Indices below `count` in rising order: all of them, or `most` evenly spread ones.
inline std::vector<size_t> evenlySpaced(size_t count, size_t most) {
  std::vector<size_t> chosen(std::min(count, most));
  for (size_t i = 0; i < chosen.size(); ++i) chosen[i] = i * count / chosen.size();
  return chosen;
}

} // namespace surflect
