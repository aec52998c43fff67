#include "render/lightfield/spherical/tile_file.h"

#include "surfel/base/error.h"

#include <random>

namespace surflect::spherical {
namespace {

Tile randomTile(int size, unsigned seed) {
  std::mt19937 random(seed);
  Tile tile;
  for (int i = 0; i < size * size; ++i) {
    Texel texel{};
    if (random() % 3 > 0) {
      for (size_t channel = 0; channel < 3; ++channel)
        texel[channel] = static_cast<uint16_t>(random() % 0x7bff);
      texel[3] = 0x3c00;
    }
    tile.colors.push_back(texel);
    tile.heights.push_back(static_cast<Height>(random()));
  }
  return tile;
}

TEST(TileCoding, ReturnsTheTexelsExactly) {
  for (const int size : {1, 8, 32}) {
    const Tile tile = randomTile(size, 8);
    EXPECT_EQ(decoded(encoded(tile, size), size), tile);
  }
}

TEST(TileCoding, SmoothImagesTakeFewBytes) {
  Tile tile;
  for (int i = 0; i < 64 * 64; ++i) {
    const auto value = static_cast<uint16_t>(0x3000 + i % 64);
    tile.colors.push_back({value, value, value, 0x3c00});
    tile.heights.push_back(static_cast<Height>(30000 + 3 * (i % 64)));
  }
  EXPECT_LT(encoded(tile, 64).size(), 64u * 64 * sizeof(Texel) / 50);
}

TEST(TileCoding, OtherSizesAndTruncationsAreRefused) {
  const auto bytes = encoded(randomTile(8, 9), 8);
  EXPECT_THROW(decoded(bytes, 16), Error);
  EXPECT_THROW(decoded(bytes, 4), Error);
  for (size_t length = 0; length < bytes.size(); ++length)
    EXPECT_THROW(decoded(std::span(bytes).first(length), 8), Error);
}

TEST(TileCoding, TexelsThatAreNoColoursAreRefused) {
  for (const Texel& bad : {Texel{0x7c00, 0, 0, 0x3c00}, Texel{0, 0xffff, 0, 0}, Texel{0, 0, 0, 0x3c01},
                           Texel{0, 0, 0, 0xbc00}}) {
    Tile tile = randomTile(8, 10);
    tile.colors[20] = bad;
    EXPECT_THROW(decoded(encoded(tile, 8), 8), Error);
  }
}

} // namespace
} // namespace surflect::spherical
