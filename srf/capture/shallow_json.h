// Limits the nesting of JSON before it is parsed, because the library copies and prints values by recursion.
// The library's own callback would search a whole list for each element.
#pragma once

#include <cstddef>
#include <string_view>

namespace surflect::capture {

inline constexpr int kDeepestJson = 64; // more than descriptions by other programs need

// Prefix of the text up to where more than `deepest` lists and objects are nested; the whole text if they
// never are.
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
