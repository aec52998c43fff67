#include "surfel/base/text.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace surflect {

size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> beforeLast(b.size() + 1), last(b.size() + 1), row(b.size() + 1); // prefixes of a
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    beforeLast.swap(last);
    last.swap(row);
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      const bool isSwapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (isSwapped) row[j] = std::min(row[j], beforeLast[j - 2] + 1);
    }
  }
  return row.back();
}

namespace {

constexpr size_t kLongestName = 256; // of files; a longer one is no slip of the keyboard

std::string withoutDigits(std::string_view name) {
  std::string letters(name);
  std::erase_if(letters, [](char c) { return c >= '0' && c <= '9'; });
  return letters;
}

} // namespace

std::string_view nearestName(std::string_view name, std::span<const std::string_view> known) {
  const std::string typed = lowerCase(name.substr(0, kLongestName));
  std::pair<bool, size_t> least(true, std::string_view::npos);
  std::string_view nearest;
  for (const std::string_view each : known) {
    const std::string other = lowerCase(each.substr(0, kLongestName));
    const bool isBegun = typed.size() >= 3 && other.starts_with(typed); // shorter ones begin too many names
    const size_t distance = editDistance(typed, other);
    const bool isNear = 3 * distance <= std::max(typed.size(), other.size()) + 1;
    const bool isOtherNumber = distance > 0 && withoutDigits(typed) == withoutDigits(other);
    const std::pair found(!isBegun, distance);
    if (!isOtherNumber && (isBegun || isNear) && found < least) {
      least = found;
      nearest = each;
    }
  }
  return nearest;
}

std::string didYouMean(std::string_view name, std::span<const std::string_view> known,
                       std::string_view before) {
  const std::string_view nearest = nearestName(name, known);
  return nearest.empty() ? "" : "; did you mean " + std::string(before) + std::string(nearest) + "?";
}

} // namespace surflect
