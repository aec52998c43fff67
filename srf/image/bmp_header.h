// Fourth byte and colours of a Windows bitmap, as its header states them.
#pragma once

#include "srf/image/color_encoding.h"

#include <optional>
#include <string_view>

namespace surflect::image {

struct BmpHeader {
  bool declaresAlpha = false; // there is a mask of bits for it; else what lies in a fourth byte is anything
  std::optional<ColorStatement> color;
};

// Throws Error without the file's name where 32 bits are in another order than blue, green, red and alpha.
// Other faults are for the reader of the pixels to say.
BmpHeader bmpHeader(std::string_view file);

} // namespace surflect::image
