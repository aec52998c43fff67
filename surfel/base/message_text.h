// Phrases of messages: a count with its noun, the size of a picture.
#pragma once

#include <cstddef>
#include <string>

namespace surflect {

// "1 frame", "2 frames"
inline std::string counted(size_t count, const char* noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

// "640 x 480"
template <class Integer> std::string sizeText(Integer width, Integer height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

} // namespace surflect
