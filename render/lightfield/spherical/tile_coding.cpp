#include "render/lightfield/spherical/tile_coding.h"

#include "surfel/base/error.h"

#include <libdeflate.h>

#include <cassert>
#include <memory>
#include <new>
#include <string>

namespace surflect::spherical {

namespace {

constexpr size_t kPlanes = 5; // r, g, b, alpha, height; of 16 bits
constexpr int kEffort = 6;    // of libdeflate, 1..12

uint16_t valueAt(const Tile& tile, size_t plane, size_t texel) {
  return plane < 4 ? tile.colors[texel][plane] : tile.heights[texel];
}

// Plane by plane: high bytes of the differences from the texel before in the row, then their low bytes.
std::vector<uint8_t> differences(const Tile& tile, size_t size) {
  const size_t texels = size * size;
  std::vector<uint8_t> bytes(2 * kPlanes * texels);
  for (size_t plane = 0; plane < kPlanes; ++plane)
    for (size_t texel = 0; texel < texels; ++texel) {
      const int before = texel % size == 0 ? 0 : valueAt(tile, plane, texel - 1);
      const auto difference = static_cast<uint16_t>(valueAt(tile, plane, texel) - before);
      bytes[2 * plane * texels + texel] = static_cast<uint8_t>(difference >> 8);
      bytes[(2 * plane + 1) * texels + texel] = static_cast<uint8_t>(difference);
    }
  return bytes;
}

Tile summed(std::span<const uint8_t> bytes, size_t size) {
  const size_t texels = size * size;
  Tile tile{std::vector<Texel>(texels), std::vector<Height>(texels)};
  for (size_t plane = 0; plane < kPlanes; ++plane)
    for (size_t texel = 0; texel < texels; ++texel) {
      const int before = texel % size == 0 ? 0 : valueAt(tile, plane, texel - 1);
      const int difference = bytes[2 * plane * texels + texel] << 8 | bytes[(2 * plane + 1) * texels + texel];
      const auto value = static_cast<uint16_t>(before + difference);
      (plane < 4 ? tile.colors[texel][plane] : tile.heights[texel]) = value;
    }
  return tile;
}

bool isValid(const Texel& texel) {
  constexpr uint16_t kExponent = 0x7c00, kOne = 0x3c00;
  for (const uint16_t half : texel)
    if ((half & kExponent) == kExponent) return false;
  return texel[3] <= kOne;
}

} // namespace

std::vector<std::byte> encoded(const Tile& tile, int size) {
  assert(tile.colors.size() == static_cast<size_t>(size) * static_cast<size_t>(size));
  assert(tile.heights.size() == tile.colors.size());
  const std::vector<uint8_t> raw = differences(tile, static_cast<size_t>(size));
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(kEffort), libdeflate_free_compressor);
  if (!compressor) throw std::bad_alloc();
  std::vector<std::byte> bytes(libdeflate_zlib_compress_bound(compressor.get(), raw.size()));
  bytes.resize(
      libdeflate_zlib_compress(compressor.get(), raw.data(), raw.size(), bytes.data(), bytes.size()));
  return bytes;
}

Tile decoded(std::span<const std::byte> bytes, int size) {
  const auto side = static_cast<size_t>(size);
  std::vector<uint8_t> raw(2 * kPlanes * side * side);
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!decompressor) throw std::bad_alloc();
  size_t consumed = 0, produced = 0;
  if (libdeflate_zlib_decompress_ex(decompressor.get(), bytes.data(), bytes.size(), raw.data(), raw.size(),
                                    &consumed, &produced) != LIBDEFLATE_SUCCESS ||
      produced != raw.size() || consumed != bytes.size())
    throw Error::mismatch("a zlib stream of " + std::to_string(raw.size()) + " bytes", "something else");
  Tile tile = summed(raw, side);
  for (size_t texel = 0; texel < tile.colors.size(); ++texel)
    if (!isValid(tile.colors[texel]))
      throw Error::mismatch("finite colours and an alpha of 0..1", "others")
          .at("texel " + std::to_string(texel));
  return tile;
}

} // namespace surflect::spherical
