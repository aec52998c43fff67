// The chunks of a PNG file that say what its samples mean.
#pragma once

#include "srf/image/color_encoding.h"

#include <optional>
#include <string_view>

namespace surflect::image {

// Colour statement of a file, or of its beginning up to the pixels, by its strongest chunk: cICP before iCCP,
// sRGB, and gAMA with cHRM. What is wrong with that chunk is the statement's problem; weaker ones are not
// read.
std::optional<ColorStatement> pngColorStatement(std::string_view file);

// Whether a chunk of that name begins in a file, or in its beginning, and not after the first with pixels,
// "IDAT".
bool hasPngChunk(std::string_view file, std::string_view name);

} // namespace surflect::image
