// PNG pictures, as encoded values in 0..1, and what the file says that they mean.
#pragma once

#include "srf/image/color_encoding.h"
#include "srf/image/image.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace surflect::image {

struct PngPicture {
  Image image; // 1 gray, 2 gray and alpha, 3 RGB, 4 RGBA; alpha is straight, it does not scale the colour
  int bitDepth = 8; // 8 or 16; shallower samples and palettes are widened to 8
  std::optional<ColorStatement> color;
};

// Throws Error for a damaged file, any truncated one, and for more than 2^28 pixels.
PngPicture readPng(const std::filesystem::path& path);

struct PngHeader {
  int width = 0, height = 0;
  bool hasAlpha = false; // a channel of its own, or transparent colours
  int bitDepth = 8;      // as in PngPicture
  std::optional<ColorStatement> color;
};
// Reads what comes before the pixels.
PngHeader readPngHeader(const std::filesystem::path& path);

enum class PngColors { unstated, srgb }; // srgb: the file says so, in a chunk

// Content of a file: rows of samples, of 16 bits with the high byte first.
struct PngSamples {
  int width = 0, height = 0, channels = 0; // 1 to 4, as above
  int bitDepth = 8;                        // 8 or 16
  PngColors colors = PngColors::unstated;
  std::vector<uint8_t> bytes;

  size_t rowBytes() const {
    return static_cast<size_t>(width) * static_cast<size_t>(channels) * static_cast<size_t>(bitDepth / 8);
  }
};

// The bytes of a PNG file with these samples. Equal samples give equal bytes.
std::string pngBytes(const PngSamples& picture);

// The nearest of 0..most to a value clamped to 0..1, ties up; what is no number is black.
inline uint16_t quantized(float value, float most) {
  const float unit = value > 0 ? std::min(value, 1.f) : 0;
  return static_cast<uint16_t>(static_cast<int>(double{unit * most} + 0.5)); // lround, but in lanes
}

// Writes an image of 1 to 4 channels (as above) atomically, rounding values clamped to 0..1 to 8 or 16 bits.
// Throws Error.
void writePng(const std::filesystem::path& path, const Image& image, int bitDepth = 8,
              PngColors colors = PngColors::unstated);

} // namespace surflect::image
