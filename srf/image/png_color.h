// The chunks of a PNG file that say what its samples mean.
#pragma once

#include "srf/image/color_encoding.h"

#include <optional>
#include <string_view>

namespace surflect {

// Of a file, or of its beginning up to the pixels: what its strongest chunk says; cICP before iCCP, sRGB, and
// gAMA with cHRM. What is wrong with that chunk is the statement's problem.
std::optional<ColorStatement> pngColorStatement(std::string_view file);

// Whether the beginning of a file reaches its pixels, so that it has all chunks that say so.
bool reachesPngPixels(std::string_view start);

} // namespace surflect
