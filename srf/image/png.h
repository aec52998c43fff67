// PNG pictures as encoded values in 0..1, with the file's colour statement.
#pragma once

#include "srf/image/color.h"
#include "srf/image/image.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace surflect::image {

// Chunks of a PNG file that define the meaning of its samples.

// Colour statement of a file, or of its beginning up to the pixels, by its strongest chunk: cICP before iCCP,
// sRGB, and gAMA with cHRM. A fault in that chunk is the statement's `problem`; weaker chunks are not read.
std::optional<ColorStatement> pngColorStatement(std::string_view file);

// Returns whether a chunk of that name begins at or before the first "IDAT"; `file` may be its beginning.
bool hasPngChunk(std::string_view file, std::string_view name);

struct PngPicture {
  Image image;      // 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA; colours are not multiplied by alpha
  int bitDepth = 8; // 8 or 16; fewer bits and palettes are widened to 8
  std::optional<ColorStatement> color;
};

// Reads a picture. Throws Error for a damaged or truncated file and for more than 2^28 pixels.
PngPicture readPng(const std::filesystem::path& path);

struct PngHeader {
  int width = 0, height = 0;
  bool hasAlpha = false; // an alpha channel, or transparent colours
  int bitDepth = 8;      // as in PngPicture
  std::optional<ColorStatement> color;
};
// Reads the chunks before the pixels.
PngHeader readPngHeader(const std::filesystem::path& path);

enum class PngColors { unstated, srgb }; // srgb: writes an sRGB chunk

// Samples to write, row by row; 16-bit samples have the high byte first.
struct PngSamples {
  int width = 0, height = 0, channels = 0; // channels: 1 to 4, as in PngPicture
  int bitDepth = 8;                        // 8 or 16
  PngColors colors = PngColors::unstated;
  std::vector<uint8_t> bytes;
  std::vector<std::pair<std::string, std::string>> texts = {}; // keywords of 1 to 79 letters, ASCII

  size_t rowBytes() const {
    return static_cast<size_t>(width) * static_cast<size_t>(channels) * static_cast<size_t>(bitDepth / 8);
  }
};

// Bytes of a PNG file with these samples. Equal samples give equal bytes.
std::string pngBytes(const PngSamples& picture);

// Value clamped to 0..1, times `most`, rounded to the nearest integer, ties up; NaN becomes 0.
inline uint16_t quantized(float value, float most) {
  const float unit = value > 0 ? std::min(value, 1.f) : 0;
  return static_cast<uint16_t>(static_cast<int>(double{unit * most} + 0.5)); // vectorises, unlike lround
}

// Writes an image of 1 to 4 channels atomically, with values clamped to 0..1 and rounded to 8 or 16 bits.
// Throws Error.
void writePng(const std::filesystem::path& path, const Image& image, int bitDepth = 8,
              PngColors colors = PngColors::unstated);

} // namespace surflect::image
