#include "surfel/base/text.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>
#include <vector>

namespace surflect {

size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

std::string_view nearestName(std::string_view name, std::span<const std::string_view> known) {
  assert(!known.empty());
  const bool isLong = name.size() >= 3; // shorter ones begin too many names
  return *std::ranges::min_element(known, {}, [&](std::string_view other) {
    return std::pair(!(isLong && other.starts_with(name)), editDistance(name, other));
  });
}

} // namespace surflect
