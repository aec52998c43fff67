// PNG pictures, as encoded values in 0..1; what the numbers mean (sRGB, linear) is for the caller to say.
#pragma once

#include "srf/image/image.h"

#include <filesystem>

namespace surflect {

struct PngPicture {
  Image image; // 1 gray, 2 gray and alpha, 3 RGB, 4 RGBA; alpha is straight, it does not scale the colour
  int bitDepth = 8; // 8 or 16; shallower samples and palettes are widened to 8
};

struct PngSize {
  int width = 0, height = 0;
  bool hasAlpha = false; // a channel of its own, or transparent colours
};

// Throws Error for a damaged file, any truncated one, and for more than 2^28 pixels.
PngPicture readPng(const std::filesystem::path& path);
// Reads the first 64 kB at most.
PngSize readPngSize(const std::filesystem::path& path);

// Writes an image of 1 to 4 channels (as above) atomically, rounding values clamped to 0..1 to 8 or 16 bits.
// Throws Error.
void writePng(const std::filesystem::path& path, const Image& image, int bitDepth = 8);

} // namespace surflect
