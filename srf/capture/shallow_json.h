// JSON that is nested no deeper than its readers can follow: what the library makes of it is copied and
// printed by recursion. Its own way to ask, a callback, looks through all of a list for each element.
#pragma once

#include <cstddef>
#include <string_view>

namespace surflect::capture {

inline constexpr int kDeepestJson = 64; // of descriptions that other programs write

// The text up to where more than this many lists and objects hold one another; all of it where they do not.
inline std::string_view shallowPart(std::string_view json, int deepest) {
  std::ptrdiff_t depth = 0;
  bool inString = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '"') inString = !inString;
    if (inString) {
      if (c == '\\') ++i;
      continue;
    }
    if ((c == '[' || c == '{') && ++depth > deepest) return json.substr(0, i);
    if (c == ']' || c == '}') --depth;
  }
  return json;
}

} // namespace surflect::capture
