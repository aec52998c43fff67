#include "render/lightfield/lfm/tile.h"

#include "render/lightfield/lfm/quantization.h"
#include "render/lightfield/lfm/s3tc.h"

#include <algorithm>
#include <cassert>
#include <span>

namespace surflect::lfm {

namespace {

Blocks blocksOf(Coding coding) { return coding == Coding::dxt5 ? Blocks::dxt5 : Blocks::dxt1; }

size_t areaOf(const TileShape& tile) {
  return static_cast<size_t>(tile.width) * static_cast<size_t>(tile.height);
}

size_t tileBytes(const TileShape& tile, Coding coding) {
  return areaOf(tile) / (kBlockSide * kBlockSide) * blockBytes(blocksOf(coding));
}

// Calls work(offset of the sample in the map, texel in the tile) for all samples of a map.
void forSamples(const MapShape& shape, const TileShape& tile, const TilePlace& place, const auto& work) {
  const int size = shape.size;
  size_t sample = 0;
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < (shape.kind == MapShape::Kind::patch ? size - j : size); ++i, ++sample) {
      const int x = place.x + place.step * i, y = place.y + place.step * j;
      work(sample * shape.channels,
           static_cast<size_t>(y) * static_cast<size_t>(tile.width) + static_cast<size_t>(x));
    }
}

// Fills texels that hold no map from their left or upper neighbours, so that they do not disturb blocks.
void spread(std::vector<uint8_t>& rgba, const std::vector<bool>& isUsed, const TileShape& tile) {
  const auto width = static_cast<size_t>(tile.width);
  for (size_t i = 0; i < isUsed.size(); ++i)
    if (!isUsed[i] && i > 0) {
      const size_t from = i % width > 0 ? i - 1 : i - width;
      std::copy_n(&rgba[4 * from], 4, &rgba[4 * i]);
    }
}

} // namespace

Coding compressedCoding(const MapShape& shape) { return shape.channels == 4 ? Coding::dxt5 : Coding::dxt1; }

TileShape tileShapeOf(const MapShape& shape, Coding coding) {
  TileShape tile{shape.size, shape.size, 1};
  if (shape.kind == MapShape::Kind::patch)
    tile = {shape.size + 1, shape.size, shape.channels == 1 ? size_t{6} : size_t{2}};
  if (coding != Coding::bytes) tile.width = wholeBlocks(tile.width), tile.height = wholeBlocks(tile.height);
  return tile;
}

TilePlace placeOf(const MapShape& shape, size_t map) {
  if (shape.kind == MapShape::Kind::view) return {map};
  const size_t triangle = shape.channels == 1 ? map / 3 : map;
  TilePlace place{triangle / 2};
  if (triangle % 2 == 1) place.x = shape.size, place.y = shape.size - 1, place.step = -1;
  if (shape.channels == 1) place.channel = static_cast<int>(map % 3);
  return place;
}

size_t tilesOf(const MapShape& shape, Coding coding, size_t maps) {
  const size_t perTile = tileShapeOf(shape, coding).maps;
  return (maps + perTile - 1) / perTile;
}

size_t bytesOf(const MapShape& shape, Coding coding, size_t maps) {
  if (coding == Coding::bytes) return maps * shape.bytes();
  return tilesOf(shape, coding, maps) * tileBytes(tileShapeOf(shape, coding), coding);
}

std::vector<uint8_t> tileTexels(const MapShape& shape, const MapSet& maps, size_t tile) {
  assert(maps.coding == Coding::bytes);
  const TileShape tileShape = tileShapeOf(shape, Coding::bytes);
  std::vector<uint8_t> rgba(4 * areaOf(tileShape), 0);
  const size_t end = std::min(maps.count, (tile + 1) * tileShape.maps);
  for (size_t map = tile * tileShape.maps; map < end; ++map) {
    const TilePlace place = placeOf(shape, map);
    const uint8_t* from = &maps.data[map * shape.bytes()];
    forSamples(shape, tileShape, place, [&](size_t offset, size_t texel) {
      std::copy_n(from + offset, shape.channels, &rgba[4 * texel + static_cast<size_t>(place.channel)]);
    });
  }
  return rgba;
}

MapSet encoded(const MapShape& shape, const MapSet& maps, bool isSigned) {
  assert(maps.coding == Coding::bytes);
  const Coding coding = compressedCoding(shape);
  const TileShape tight = tileShapeOf(shape, Coding::bytes), whole = tileShapeOf(shape, coding);
  const size_t channels = std::max<size_t>(3, shape.channels);
  MapSet result{coding, maps.count, {}};
  for (size_t tile = 0; tile < tilesOf(shape, coding, maps.count); ++tile) {
    const std::vector<uint8_t> rgba = tileTexels(shape, maps, tile);
    std::vector<bool> isUsed(areaOf(whole), false);
    std::vector<uint8_t> padded(4 * areaOf(whole), 255);
    const size_t end = std::min(maps.count, (tile + 1) * tight.maps);
    for (size_t map = tile * tight.maps; map < end; ++map)
      forSamples(shape, whole, placeOf(shape, map), [&](size_t, size_t texel) { isUsed[texel] = true; });
    for (size_t y = 0; y < static_cast<size_t>(tight.height); ++y)
      for (size_t x = 0; x < static_cast<size_t>(tight.width); ++x)
        for (size_t channel = 0; channel < channels; ++channel) {
          const uint8_t byte = rgba[4 * (y * static_cast<size_t>(tight.width) + x) + channel];
          padded[4 * (y * static_cast<size_t>(whole.width) + x) + channel] =
              isSigned ? biased(static_cast<int8_t>(byte)) : byte;
        }
    spread(padded, isUsed, whole);
    const std::vector<uint8_t> blocks = s3tcBlocks(padded, static_cast<size_t>(whole.width),
                                                   static_cast<size_t>(whole.height), blocksOf(coding));
    assert(blocks.size() == tileBytes(whole, coding));
    result.data.insert(result.data.end(), blocks.begin(), blocks.end());
  }
  return result;
}

MapSet decoded(const MapShape& shape, const MapSet& maps, bool isSigned) {
  assert(maps.coding == compressedCoding(shape));
  const TileShape whole = tileShapeOf(shape, maps.coding);
  const size_t bytes = tileBytes(whole, maps.coding);
  MapSet result{Coding::bytes, maps.count, std::vector<uint8_t>(maps.count * shape.bytes())};
  for (size_t map = 0; map < maps.count; ++map) {
    const TilePlace place = placeOf(shape, map);
    const auto blocks = std::span(maps.data).subspan(place.tile * bytes, bytes);
    const std::vector<uint8_t> rgba = s3tcTexels(blocks, static_cast<size_t>(whole.width),
                                                 static_cast<size_t>(whole.height), blocksOf(maps.coding));
    uint8_t* to = &result.data[map * shape.bytes()];
    forSamples(shape, whole, place, [&](size_t offset, size_t texel) {
      for (size_t channel = 0; channel < shape.channels; ++channel) {
        const uint8_t byte = rgba[4 * texel + static_cast<size_t>(place.channel) + channel];
        to[offset + channel] = isSigned ? static_cast<uint8_t>(unbiased(byte)) : byte;
      }
    });
  }
  return result;
}

namespace {

// Calls change(maps, shape, isSigned) for all maps of a light field.
void forMapSets(LightFieldMaps& maps, const auto& change) {
  const bool isSigned = maps.method == Factorization::pca;
  for (size_t k = 0; k < maps.terms.size(); ++k) {
    change(maps.terms[k].surface.maps, surfaceShape(maps), isSigned);
    change(maps.terms[k].view.maps, viewShape(maps, k), isSigned);
  }
  change(maps.mean.maps, meanShape(maps), false);
}

} // namespace

LightFieldMaps encoded(LightFieldMaps maps) {
  forMapSets(maps, [](MapSet& set, const MapShape& shape, bool isSigned) {
    if (set.coding == Coding::bytes) set = encoded(shape, set, isSigned);
  });
  return maps;
}

LightFieldMaps decoded(LightFieldMaps maps) {
  forMapSets(maps, [](MapSet& set, const MapShape& shape, bool isSigned) {
    if (set.coding != Coding::bytes) set = decoded(shape, set, isSigned);
  });
  return maps;
}

} // namespace surflect::lfm
