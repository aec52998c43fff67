// Phrases of messages: a count with its noun, the size of a picture; and text for pages.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace surflect {

// "1 frame", "2 frames"
inline std::string counted(size_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

// "640 x 480"
template <class Integer> std::string sizeText(Integer width, Integer height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

// Text for HTML and SVG: &, <, >, " and ' become entities, control characters the replacement character.
inline std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else if (c == '"')
      safe += "&quot;";
    else if (c == '\'')
      safe += "&#39;";
    else if ((byte < 0x20 && c != '\n' && c != '\t') || byte == 0x7f)
      safe += "&#xFFFD;";
    else
      safe += c;
  }
  return safe;
}

} // namespace surflect
