// PNG pictures, as encoded values in 0..1; what the numbers mean (sRGB, linear) is for the caller to say.
#pragma once

#include "srf/image/image.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

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

// What a file holds: rows of samples, of 16 bits with the high byte first.
struct PngSamples {
  int width = 0, height = 0, channels = 0; // 1 to 4, as above
  int bitDepth = 8;                        // 8 or 16
  std::vector<uint8_t> bytes;

  size_t rowBytes() const {
    return static_cast<size_t>(width) * static_cast<size_t>(channels) * static_cast<size_t>(bitDepth / 8);
  }
};
// The nearest of 0..most to a value clamped to 0..1, ties up; what is no number is black.
inline uint16_t quantized(float value, float most) {
  const float unit = value > 0 ? std::min(value, 1.f) : 0;
  return static_cast<uint16_t>(static_cast<int>(double{unit * most} + 0.5)); // lround, but in lanes
}

// A file of them; the same samples give the same bytes.
std::string pngBytes(const PngSamples& picture);

// Writes an image of 1 to 4 channels (as above) atomically, rounding values clamped to 0..1 to 8 or 16 bits.
// Throws Error.
void writePng(const std::filesystem::path& path, const Image& image, int bitDepth = 8);

} // namespace surflect
