#include "render/lightfield/lfm/tile.h"

#include "render/lightfield/lfm/map_drawing.h"
#include "surfel/base/error.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/srf/image/files.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

namespace surflect::lfm {
namespace {

using namespace lfm::testing;

constexpr MapShape kPacked{MapShape::Kind::patch, 5, 3}, kScalar{MapShape::Kind::patch, 5, 1},
    kView{MapShape::Kind::view, 6, 3}, kOpacityMean{MapShape::Kind::patch, 5, 4},
    kOpacityView{MapShape::Kind::view, 6, 4};

MapSet numberedMaps(const MapShape& shape, size_t count) {
  MapSet maps{Coding::bytes, count, std::vector<uint8_t>(count * shape.bytes())};
  for (size_t i = 0; i < maps.data.size(); ++i) maps.data[i] = static_cast<uint8_t>(1 + i % 255);
  return maps;
}

TEST(Tile, HoldsItsMapsWithoutGapOrOverlap) {
  for (const MapShape& shape : {kPacked, kScalar, kView, kOpacityMean, kOpacityView}) {
    const TileShape tile = tileShapeOf(shape, Coding::bytes);
    const MapSet maps = numberedMaps(shape, tile.maps);
    const std::vector<uint8_t> rgba = tileTexels(shape, maps, 0);
    std::vector<uint8_t> found, expected = maps.data;
    for (size_t i = 0; i < rgba.size(); ++i)
      if (i % 4 < 3 || shape.channels == 4) found.push_back(rgba[i]);
    std::ranges::sort(found);
    std::ranges::sort(expected);
    EXPECT_EQ(found, expected); // each byte once, and no texel without a map
  }
}

TEST(Tile, SamplesLieAtTheirPlaces) {
  const MapSet maps = numberedMaps(kScalar, 9);
  const PatchGrid grid(kScalar.size);
  for (size_t map = 0; map < maps.count; ++map) {
    const TilePlace place = placeOf(kScalar, map);
    const std::vector<uint8_t> rgba = tileTexels(kScalar, maps, place.tile);
    for (size_t sample = 0; sample < grid.samples(); ++sample) {
      const auto [i, j] = grid.place(sample);
      const int x = place.x + place.step * i, y = place.y + place.step * j;
      EXPECT_EQ(rgba[static_cast<size_t>(4 * (y * (kScalar.size + 1) + x) + place.channel)],
                maps.data[map * kScalar.bytes() + sample]);
    }
  }
  EXPECT_EQ(tilesOf(kScalar, Coding::bytes, 9), 2u);
  EXPECT_EQ(tilesOf(kPacked, Coding::bytes, 9), 5u);
  EXPECT_EQ(tilesOf(kView, Coding::bytes, 9), 9u);
}

// The last tile is not full: its maps are not disturbed by what fills the rest.
TEST(Tile, MapsOfAColorThatBlocksHaveAreKeptByCompression) {
  for (const bool isSigned : {false, true})
    for (const MapShape& shape : {kPacked, kScalar, kView, kOpacityMean, kOpacityView}) {
      const uint8_t one = isSigned ? 127 : 255; // the byte of value 1
      const MapSet maps{Coding::bytes, 7, std::vector<uint8_t>(7 * shape.bytes(), one)};
      const MapSet blocks = encoded(shape, maps, isSigned);
      EXPECT_EQ(blocks.coding, shape.channels == 4 ? Coding::dxt5 : Coding::dxt1);
      EXPECT_EQ(blocks.data.size(), bytesOf(shape, blocks.coding, 7));
      const MapSet again = decoded(shape, blocks, isSigned);
      EXPECT_EQ(again.count, 7u);
      EXPECT_EQ(again.data, maps.data);
    }
}

// Two triangles of 300 samples: 25 x 24 texels, padded to 7 x 6 blocks.
TEST(Tile, BytesAreThoseOfSamplesOrWholeBlocks) {
  const MapShape real{MapShape::Kind::patch, 24, 3};
  EXPECT_EQ(bytesOf(real, Coding::dxt1, 2), 8u * 7 * 6);
  EXPECT_EQ(bytesOf(real, Coding::bytes, 2), 1800u);
  const MapShape opacity{MapShape::Kind::patch, 24, 4};
  EXPECT_EQ(bytesOf(opacity, Coding::dxt5, 2), 16u * 7 * 6);
  EXPECT_EQ(bytesOf(opacity, Coding::bytes, 2), 2400u);
}

// Bytes of the cells of view maps from the second term on.
std::vector<uint8_t> higherBytes(const LightFieldMaps& maps) { return maps.terms[1].view.maps.data; }

TEST(HigherViewSize, OfAllCellsChangesNoByte) {
  const LightFieldMaps maps = syntheticMaps(squarePatch(2));
  EXPECT_EQ(higherBytes(withHigherViewSize(maps, maps.viewSize)), higherBytes(maps));
}

TEST(HigherViewSize, CellsAreMeansOfThoseThatTheyCover) {
  LightFieldMaps maps = syntheticMaps(squarePatch(2), {.viewSize = 6, .terms = 2});
  const LightFieldMaps halves = withHigherViewSize(maps, 3);
  EXPECT_EQ(halves.terms[0].view.maps.data, maps.terms[0].view.maps.data);
  ASSERT_EQ(higherBytes(halves).size(), higherBytes(maps).size() / 4);
  const auto code = [](const LightFieldMaps& of, int size, int x, int y) {
    return static_cast<int8_t>(higherBytes(of)[static_cast<size_t>(3 * (y * size + x))]);
  };
  const double before = maps.terms[1].scale[0], after = halves.terms[1].scale[0];
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x) {
      double sum = 0;
      for (int i = 0; i < 4; ++i) sum += code(maps, 6, 2 * x + i % 2, 2 * y + i / 2);
      EXPECT_NEAR(after * code(halves, 3, x, y), before * sum / 4, 0.51 * after);
    }
  // Cells of another number keep what is equal everywhere.
  for (uint8_t& byte : maps.terms[1].view.maps.data) byte = 100;
  const LightFieldMaps equal = withHigherViewSize(maps, 4);
  for (const uint8_t byte : higherBytes(equal)) EXPECT_EQ(byte, 127);
  EXPECT_NEAR(equal.terms[1].scale[0] * 127, maps.terms[1].scale[0] * 100, 1e-4 * maps.terms[1].scale[0]);
  EXPECT_THROW(withHigherViewSize(maps, 7), Error);
}

// A highlight in one of 2 x 2 cells has a quarter of its value, in as many codes; NMF has no signs.
TEST(HigherViewSize, SmallerMapsUseAllCodes) {
  for (const Factorization method : {Factorization::pca, Factorization::nmf}) {
    LightFieldMaps maps = syntheticMaps(squarePatch(2), {.method = method, .viewSize = 6, .terms = 2});
    const double one = method == Factorization::pca ? 127 : 255;
    std::vector<uint8_t>& bytes = maps.terms[1].view.maps.data;
    std::ranges::fill(bytes, uint8_t{1});
    for (size_t map = 0; map < maps.terms[1].view.maps.count; ++map)
      bytes[map * 6 * 6 * 3] = static_cast<uint8_t>(one);
    const LightFieldMaps halves = withHigherViewSize(maps, 3);
    const double scale = halves.terms[1].scale[0], before = maps.terms[1].scale[0];
    EXPECT_EQ(higherBytes(halves)[0], static_cast<uint8_t>(one));
    EXPECT_NEAR(scale, before * (one + 3) / (4 * one), 1e-5 * before);
    EXPECT_NEAR(scale * higherBytes(halves)[3] / one, before / one, 0.51 * scale / one);
  }
}

TEST(Tiling, PlacesAreDistinctAndInside) {
  for (const size_t tiles : {1u, 2u, 7u, 100u, 1000u, 12345u}) {
    const Tiling tiling = tilingOf({25, 24, 2}, tiles, {.side = 256, .layers = 16, .largestSide = 4096});
    EXPECT_LE(tiling.layers, 16);
    std::set<std::tuple<int, int, int>> places;
    for (size_t i = 0; i < tiles; ++i) {
      const Tiling::Place place = tiling.placeOf(i);
      EXPECT_TRUE(places.emplace(place.x, place.y, place.layer).second);
      ASSERT_LE(place.x + 25, tiling.width());
      ASSERT_LE(place.y + 24, tiling.height());
      ASSERT_LT(place.layer, tiling.layers);
    }
    // At most a row of tiles of each layer is left over.
    const size_t held = static_cast<size_t>(tiling.columns) * tiling.rows * tiling.layers;
    EXPECT_LT(held - tiles, static_cast<size_t>(tiling.columns + 1) * tiling.layers);
  }
}

TEST(Tiling, WhatNoTextureHoldsIsRefused) {
  EXPECT_EQ(image::errorOf([] {
              tilingOf({32, 32, 1}, 100000, {.side = 64, .layers = 2, .largestSide = 1024});
            }),
            "100000 tiles of 32 x 32 texels do not fit into a texture");
}

} // namespace
} // namespace surflect::lfm
