// Collections of tiles: layers of an array texture, each with columns x rows tiles.
//
// [Chen et al. 2002, §5.3] tiles light field maps of one size together, and draws triangle after triangle
// without a change of textures. Array textures hold all collections of one size, of all terms.
#pragma once

#include "render/lightfield/lfm/tile.h"

#include <cstddef>

namespace surflect::lfm {

struct Tiling {
  TileShape tile;
  int columns = 1, rows = 1, layers = 1;

  int width() const { return columns * tile.width; }
  int height() const { return rows * tile.height; }

  struct Place {
    int x = 0, y = 0, layer = 0; // the tile's first texel
  };
  Place placeOf(size_t tileNumber) const;
};

struct TilingLimits {
  int side = 2048;  // of a layer, texels
  int layers = 256; // at most; sides grow beyond `side` before there are more
  int largestSide = 16384;
};

// Layers of equal size with little left over. Throws Error if the tiles do not fit.
Tiling tilingOf(const TileShape& tile, size_t tiles, const TilingLimits& limits = {});

} // namespace surflect::lfm
