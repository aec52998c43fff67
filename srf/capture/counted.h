// A number with its noun, for messages.
#pragma once

#include <cstddef>
#include <string>

namespace surflect::capture {

// "1 frame", "2 frames"
inline std::string counted(size_t count, const char* thing) {
  return std::to_string(count) + " " + thing + (count == 1 ? "" : "s");
}

} // namespace surflect::capture
