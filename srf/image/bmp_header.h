// Fourth byte and colours of a Windows bitmap, as its header states them.
#pragma once

#include "srf/image/color_encoding.h"

#include <optional>
#include <string_view>

namespace surflect::image {

struct BmpHeader {
  bool declaresAlpha = false; // a bit mask for alpha exists; otherwise the fourth byte has no defined meaning
  std::optional<ColorStatement> color;
};

// Throws Error, without the file's name, if 32-bit pixels are in another order than blue, green, red, alpha.
// Other faults are left to the reader of the pixels.
BmpHeader bmpHeader(std::string_view file);

} // namespace surflect::image
