#include "render/lightfield/lfm/s3tc.h"

#include <squish.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>

namespace surflect::lfm {

namespace {

constexpr size_t kSide = kBlockSide, kTexels = kSide * kSide, kChannels = 4;

using Texel = std::array<uint8_t, kChannels>;
using BlockTexels = std::array<Texel, kTexels>;

// Calls visit(offset of the block's first texel in the image, number of the block) for each block.
template <class Visit> void forEachBlock(size_t width, size_t height, const Visit& visit) {
  for (size_t y = 0, block = 0; y < height; y += kSide)
    for (size_t x = 0; x < width; x += kSide, ++block) visit(kChannels * (y * width + x), block);
}

uint64_t littleEndian(const uint8_t* bytes, size_t count) {
  uint64_t number = 0;
  for (size_t i = 0; i < count; ++i) number |= uint64_t{bytes[i]} << 8 * i;
  return number;
}

// Red, green and blue of a colour, of 5, 6 and 5 bits.
std::array<int, 3> fields(uint64_t color) {
  return {static_cast<int>(color >> 11 & 31), static_cast<int>(color >> 5 & 63),
          static_cast<int>(color & 31)};
}

// Colours of a block, rounded once: a mixture is a fraction over `whole` x the largest number of the field.
// [EXT_texture_compression_s3tc] DXT5 always has two mixtures.
void decodeColors(const uint8_t* block, Blocks kind, BlockTexels& texels) {
  const uint64_t first = littleEndian(block, 2), second = littleEndian(block + 2, 2);
  const uint64_t codes = littleEndian(block + 4, 4);
  const std::array<int, 3> a = fields(first), b = fields(second);
  const bool hasTwoMixtures = first > second || kind == Blocks::dxt5;
  for (size_t i = 0; i < kTexels; ++i) {
    const uint64_t code = codes >> 2 * i & 3;
    // Parts of the second colour, of a whole.
    const int whole = hasTwoMixtures ? 3 : 2;
    const std::array<int, 4> parts = hasTwoMixtures ? std::array{0, 3, 1, 2} : std::array{0, 2, 1, 0};
    const bool isBlack = !hasTwoMixtures && code == 3;
    for (size_t c = 0; c < 3; ++c) {
      const int most = c == 1 ? 63 : 31, q = parts[code];
      const int value = (a[c] * (whole - q) + b[c] * q) * 255; // over whole x most
      texels[i][c] = isBlack ? 0 : static_cast<uint8_t>((2 * value + whole * most) / (2 * whole * most));
    }
    texels[i][3] = isBlack ? 0 : 255;
  }
}

// Alphas of the first half of a DXT5 block, rounded once.  [EXT_texture_compression_s3tc]
void decodeAlphas(const uint8_t* block, BlockTexels& texels) {
  const int first = block[0], second = block[1];
  const uint64_t codes = littleEndian(block + 2, 6);
  // Mixtures of the two; of five parts, the last two codes are 0 and 255.
  const int whole = first > second ? 7 : 5;
  for (size_t i = 0; i < kTexels; ++i) {
    const int code = static_cast<int>(codes >> 3 * i & 7), q = code < 2 ? code * whole : code - 1;
    const int mixture = (2 * (first * (whole - q) + second * q) + whole) / (2 * whole);
    texels[i][3] = static_cast<uint8_t>(whole == 5 && code > 5 ? 255 * (code - 6) : mixture);
  }
}

} // namespace

std::vector<uint8_t> s3tcBlocks(std::span<const uint8_t> rgba, size_t width, size_t height, Blocks kind,
                                ColorFit fit) {
  assert(width % kSide == 0 && height % kSide == 0 && rgba.size() == kChannels * width * height);
  std::vector<uint8_t> blocks(width * height / kTexels * blockBytes(kind));
  forEachBlock(width, height, [&](size_t first, size_t block) {
    BlockTexels texels;
    for (size_t y = 0; y < kSide; ++y)
      std::memcpy(texels[kSide * y].data(), rgba.data() + first + kChannels * y * width, kSide * kChannels);
    if (kind == Blocks::dxt1)
      for (Texel& texel : texels) texel[3] = 255;
    squish::Compress(texels[0].data(), blocks.data() + block * blockBytes(kind),
                     (kind == Blocks::dxt5 ? squish::kDxt5 : squish::kDxt1) | squish::kColourClusterFit |
                         (fit == ColorFit::byAlpha ? squish::kWeightColourByAlpha : 0));
  });
  return blocks;
}

std::vector<uint8_t> s3tcTexels(std::span<const uint8_t> blocks, size_t width, size_t height, Blocks kind) {
  assert(width % kSide == 0 && height % kSide == 0 &&
         blocks.size() == width * height / kTexels * blockBytes(kind));
  std::vector<uint8_t> rgba(kChannels * width * height);
  forEachBlock(width, height, [&](size_t first, size_t block) {
    BlockTexels texels{};
    const uint8_t* from = blocks.data() + block * blockBytes(kind);
    decodeColors(kind == Blocks::dxt5 ? from + 8 : from, kind, texels);
    if (kind == Blocks::dxt5) decodeAlphas(from, texels);
    for (size_t y = 0; y < kSide; ++y)
      std::memcpy(rgba.data() + first + kChannels * y * width, texels[kSide * y].data(), kSide * kChannels);
  });
  return rgba;
}

std::array<uint8_t, 4> s3tcTexel(std::span<const uint8_t> block, size_t texel, Blocks kind) {
  assert(block.size() == blockBytes(kind) && texel < kTexels);
  BlockTexels texels{};
  decodeColors(kind == Blocks::dxt5 ? block.data() + 8 : block.data(), kind, texels);
  if (kind == Blocks::dxt5) decodeAlphas(block.data(), texels);
  return texels[texel];
}

} // namespace surflect::lfm
