// Lists of names in messages.
#pragma once

#include <algorithm>
#include <span>
#include <string>

namespace surflect {

// "a.png, b.png, c.png, ..": the first three.
inline std::string firstNames(std::span<const std::string> names) {
  std::string list;
  for (size_t i = 0; i < std::min<size_t>(3, names.size()); ++i) list += (i > 0 ? ", " : "") + names[i];
  return names.size() > 3 ? list + ", .." : list;
}

} // namespace surflect
