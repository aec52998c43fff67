// Colour encoding of a capture's pictures: by the capture, else by each picture's file, else by its format.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/color_encoding.h"

#include <filesystem>
#include <optional>

namespace surflect::capture {

// Default encoding of pictures: 8 bits are sRGB, all others linear. Bits as in Picture.
image::Transfer usualTransfer(int bits);

// Throws Error naming the picture if the statement of its file applies but cannot be understood.
image::ColorEncoding encodingOf(const std::optional<ColorSpace>& ofCapture,
                                const std::optional<image::ColorStatement>& ofFile,
                                const std::filesystem::path& picture);

} // namespace surflect::capture
