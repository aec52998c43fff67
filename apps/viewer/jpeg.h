// JPEG pictures for the page.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace surflect::viewer {

// A picture as screens show it: sRGB, 8 bits, rows from the top.
struct DisplayPicture {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb; // 3 * width * height
};

enum class JpegQuality {
  moving, // quality 80 with halved colour resolution: small and fast
  still   // quality 95 with full colour resolution
};

// Throws Error if the picture cannot be encoded.
std::string jpegBytes(const DisplayPicture& picture, JpegQuality quality);

} // namespace surflect::viewer
