// Text and names of messages and pages, and choices of indices.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect {

// Phrases of messages: a count with its noun, the size of a picture; and text for pages.

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

// Text in lower case; only ASCII letters change.
inline std::string lowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + ('a' - 'A'));
  return lower;
}

// Suggestion of the known name that a misspelt one means.

// Number of letters to insert, delete, replace, or swap with the next one (optimal string alignment).
size_t editDistance(std::string_view a, std::string_view b);

// Known name that begins with the typed one, if that has three letters or more; else the nearest by
// editDistance d in lower case, the first of equals. Empty if none is near, 3 d <= 1 + letters of the longer
// name; or if only digits differ, as C12 and C13 are two things.
std::string_view nearestName(std::string_view name, std::span<const std::string_view> known);

// "; did you mean fov_deg?", the end of a message; empty if no known name is near. `before` stands before the
// suggested name, such as the folder of a file.
std::string didYouMean(std::string_view name, std::span<const std::string_view> known,
                       std::string_view before = "");

// Lists of names in messages.

// "a.png, b.png, c.png, ..": the first three.
inline std::string firstNames(std::span<const std::string> names) {
  std::string list;
  for (size_t i = 0; i < std::min<size_t>(3, names.size()); ++i) list += (i > 0 ? ", " : "") + names[i];
  return names.size() > 3 ? list + ", .." : list;
}

// Even choice of indices.

// Indices below `count` in rising order: all of them, or `most` evenly spread ones.
inline std::vector<size_t> evenlySpaced(size_t count, size_t most) {
  std::vector<size_t> chosen(std::min(count, most));
  for (size_t i = 0; i < chosen.size(); ++i) chosen[i] = i * count / chosen.size();
  return chosen;
}

// 0, 1, .. count - 1
inline std::vector<uint32_t> upTo(size_t count) {
  std::vector<uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  return numbers;
}

// Base64 [RFC 4648, §4].

// Text of bytes, padded with '=' to a multiple of four characters.
inline std::string base64(std::string_view bytes) {
  constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = bytes.size() - i < 3 ? bytes.size() - i : 3;
    uint32_t bits = 0;
    for (size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < count ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) text += k <= count ? digits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

} // namespace surflect
