// PNG pictures, as encoded values in 0..1, and what the file says that they mean.
#pragma once

#include "srf/image/color_encoding.h"
#include "srf/image/image.h"

#include <filesystem>
#include <optional>

namespace surflect {

struct PngPicture {
  Image image; // 1 gray, 2 gray and alpha, 3 RGB, 4 RGBA; alpha is straight, it does not scale the colour
  int bitDepth = 8; // 8 or 16; shallower samples and palettes are widened to 8
  std::optional<ColorStatement> color;
};

struct PngSize {
  int width = 0, height = 0;
};

// Throws Error for a damaged file, any truncated one, and for more than 2^28 pixels.
PngPicture readPng(const std::filesystem::path& path);
// Reads the first bytes only.
PngSize readPngSize(const std::filesystem::path& path);

struct PngHeader {
  int bitDepth = 8; // as in PngPicture
  std::optional<ColorStatement> color;
};
// Reads what comes before the pixels.
PngHeader readPngHeader(const std::filesystem::path& path);

enum class PngColors { unstated, srgb }; // srgb: the file says so, in a chunk

// Writes an image of 1 to 4 channels (as above) atomically, rounding values clamped to 0..1 to 8 or 16 bits.
// Throws Error.
void writePng(const std::filesystem::path& path, const Image& image, int bitDepth = 8,
              PngColors colors = PngColors::unstated);

} // namespace surflect
