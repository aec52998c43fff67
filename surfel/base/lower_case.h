#pragma once

#include <string>
#include <string_view>

namespace surflect {

// Text in lower case; only ASCII letters change.
inline std::string lowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + ('a' - 'A'));
  return lower;
}

} // namespace surflect
