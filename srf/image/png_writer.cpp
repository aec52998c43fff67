// [PNG 3rd ed.] Portable Network Graphics (PNG) Specification, W3C 2025.
#include "srf/image/deflate.h"
#include "srf/image/png.h"
#include "surfel/base/file.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdlib>
#include <string_view>

namespace surflect::image {

namespace {

std::string bigEndianBytes(uint32_t value) {
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(value >> shift);
  return bytes;
}

// A chunk: length, type, data, and a checksum of the last two [PNG 3rd ed., 5.3].
std::string chunk(std::string_view type, std::string_view data) {
  const std::string body = std::string(type).append(data);
  const uint32_t check = ::libdeflate_crc32(0, body.data(), body.size());
  return bigEndianBytes(static_cast<uint32_t>(data.size())) + body + bigEndianBytes(check);
}

// Paeth predictor of the bytes left, above, and above to the left [PNG 3rd ed., 9.4]; branchless, so that
// loops vectorise.
uint8_t paethPredictor(int left, int above, int corner) {
  const int toLeft = std::abs(above - corner), toAbove = std::abs(left - corner),
            toCorner = std::abs(left + above - 2 * corner);
  const int other = toAbove <= toCorner ? above : corner;
  return static_cast<uint8_t>(toLeft <= toAbove && toLeft <= toCorner ? left : other);
}

// Rows filtered by the Paeth predictor, each after the filter's number. On rendered previews this filter
// compresses better than a choice among all by the sum of differences.
std::vector<std::byte> filtered(const PngSamples& picture) {
  constexpr std::byte kPaeth{4};
  const size_t height = static_cast<size_t>(picture.height), row = picture.rowBytes(),
               pixel = row / static_cast<size_t>(picture.width);
  std::vector<std::byte> result;
  result.reserve((row + 1) * height);
  const std::vector<uint8_t> black(pixel + row);
  // Rows begin with one black pixel.
  std::vector<uint8_t> above = black, current = black;
  std::vector<std::byte> differences(row);
  for (size_t y = 0; y < height; ++y) {
    std::copy_n(picture.bytes.data() + y * row, row, current.data() + pixel);
    for (size_t i = 0; i < row; ++i)
      differences[i] =
          static_cast<std::byte>(current[pixel + i] - paethPredictor(current[i], above[pixel + i], above[i]));
    result.push_back(kPaeth);
    result.insert(result.end(), differences.begin(), differences.end());
    std::swap(above, current);
  }
  return result;
}

// The sRGB chunk, with the closest gamma and the primaries in units of 1e-5 for other readers [PNG 3rd ed.,
// 11.3.2.1 to 11.3.2.5].
std::string srgbChunks() {
  constexpr uint32_t kGamma = 45455;
  constexpr char kRelativeColorimetric = 1;
  std::string primaries; // white, red, green, blue
  for (const uint32_t coordinate : {31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000})
    primaries += bigEndianBytes(coordinate);
  return chunk("sRGB", std::string(1, kRelativeColorimetric)) + chunk("gAMA", bigEndianBytes(kGamma)) +
         chunk("cHRM", primaries);
}

} // namespace

std::string pngBytes(const PngSamples& picture) {
  assert(picture.width > 0 && picture.height > 0 && picture.channels >= 1 && picture.channels <= 4);
  assert(picture.bytes.size() == picture.rowBytes() * static_cast<size_t>(picture.height));
  constexpr std::array<char, 4> types{0, 4, 2, 6}; // gray, gray and alpha, RGB, RGBA [PNG 3rd ed., 11.2.1]
  constexpr size_t kLargestData = size_t{1} << 30;
  std::string header = bigEndianBytes(static_cast<uint32_t>(picture.width)) +
                       bigEndianBytes(static_cast<uint32_t>(picture.height)) +
                       static_cast<char>(picture.bitDepth) + types[static_cast<size_t>(picture.channels - 1)];
  header.append(3, '\0'); // compression and filter method 0, no interlace
  const std::string data = zlibStream(filtered(picture));
  std::string file = "\x89PNG\r\n\x1a\n" + chunk("IHDR", header);
  if (picture.colors == PngColors::srgb) file += srgbChunks();
  for (const auto& [keyword, text] : picture.texts) // [PNG 3rd ed., 11.3.3.2]
    file += chunk("tEXt", keyword + '\0' + text);
  for (size_t begin = 0; begin < data.size(); begin += kLargestData)
    file += chunk("IDAT", std::string_view(data).substr(begin, kLargestData));
  return file + chunk("IEND", {});
}

void writePng(const std::filesystem::path& path, const Image& image, int bitDepth, PngColors colors) {
  assert(bitDepth == 8 || bitDepth == 16);
  PngSamples picture{image.width, image.height, image.channels, bitDepth, colors, {}};
  picture.bytes.reserve(picture.rowBytes() * static_cast<size_t>(image.height));
  for (const float value : image.values) {
    const uint16_t sample = quantized(value, bitDepth == 8 ? 255.f : 65535.f);
    if (bitDepth == 16) picture.bytes.push_back(static_cast<uint8_t>(sample >> 8));
    picture.bytes.push_back(static_cast<uint8_t>(sample));
  }
  writeFileAtomically(path, pngBytes(picture));
}

} // namespace surflect::image
