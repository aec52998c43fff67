// Chunks of a PNG file that define the meaning of its samples.
#pragma once

#include "srf/image/color_encoding.h"

#include <optional>
#include <string_view>

namespace surflect::image {

// Colour statement of a file, or of its beginning up to the pixels, by its strongest chunk: cICP before iCCP,
// sRGB, and gAMA with cHRM. A fault in that chunk is the statement's `problem`; weaker chunks are not read.
std::optional<ColorStatement> pngColorStatement(std::string_view file);

// Returns whether a chunk of that name begins at or before the first "IDAT"; `file` may be its beginning.
bool hasPngChunk(std::string_view file, std::string_view name);

} // namespace surflect::image
