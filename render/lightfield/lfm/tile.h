// Tiles: rectangles of texels that hold maps without a gap, as textures have them.
//
// Two triangles of n samples along an edge share a tile of (n + 1) x n texels: sample (i, j) of the first is
// texel (i, j), of the second texel (n - i, n - 1 - j). A view map is a tile of its own. Surface maps of one
// channel lie in red, green and blue: six to a tile. Compressed tiles are as large as whole blocks.
#pragma once

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/maps.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::lfm {

struct TileShape {
  int width = 0, height = 0; // texels
  size_t maps = 1;           // in a tile, at most
};
// dxt5 for maps with four channels, else dxt1.
Coding compressedCoding(const MapShape& shape);

TileShape tileShapeOf(const MapShape& shape, Coding coding);

// Where a map lies in its tile: sample (i, j) is texel (x + step i, y + step j), in `channel` alone if the
// map has one channel.
struct TilePlace {
  size_t tile = 0;
  int x = 0, y = 0;
  int step = 1; // or -1
  int channel = 0;
};
TilePlace placeOf(const MapShape& shape, size_t map);

size_t tilesOf(const MapShape& shape, Coding coding, size_t maps);
// Size of MapSet::data for a number of maps.
size_t bytesOf(const MapShape& shape, Coding coding, size_t maps);

// RGBA of a tile of maps whose coding is bytes; channels that they lack and texels of no map are 0.
std::vector<uint8_t> tileTexels(const MapShape& shape, const MapSet& maps, size_t tile);

// Maps of coding `bytes` compressed, tile by tile; and compressed maps as bytes of the same values.
MapSet encoded(const MapShape& shape, const MapSet& maps, bool isSigned);
MapSet decoded(const MapShape& shape, const MapSet& maps, bool isSigned);

// All maps compressed, and all maps as bytes.
LightFieldMaps encoded(LightFieldMaps maps);
LightFieldMaps decoded(LightFieldMaps maps);

} // namespace surflect::lfm
