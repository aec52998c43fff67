// How deep a JSON text is nested, told before it is parsed: what the library makes of it is copied and printed
// by recursion. Its own way to ask, a callback, looks through all of a list for each element.
#pragma once

#include <algorithm>
#include <string_view>

namespace surflect {

// The most lists and objects that hold one another. Of texts that are not JSON any number.
inline int jsonDepth(std::string_view json) {
  int depth = 0, deepest = 0;
  bool inString = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '"') inString = !inString;
    if (!inString && (c == '[' || c == '{')) deepest = std::max(deepest, ++depth);
    if (!inString && (c == ']' || c == '}')) --depth;
    if (inString && c == '\\') ++i;
  }
  return deepest;
}

} // namespace surflect
