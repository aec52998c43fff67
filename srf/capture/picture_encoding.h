// Colour encoding of a capture's pictures: as the capture says, or each picture's file, or
// its format, in this order.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/color_encoding.h"

#include <filesystem>
#include <optional>

namespace surflect::capture {

// Encoding of pictures of which nothing is said: 8 bits are sRGB, all others linear. Bits as in Picture.
image::Transfer usualTransfer(int bits);

// Throws Error naming the picture where its file's statement counts and cannot be understood.
image::ColorEncoding encodingOf(const std::optional<ColorSpace>& ofCapture,
                                const std::optional<image::ColorStatement>& ofFile,
                                const std::filesystem::path& picture);

} // namespace surflect::capture
