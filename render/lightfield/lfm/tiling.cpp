#include "render/lightfield/lfm/tiling.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace surflect::lfm {

namespace {

size_t dividedUp(size_t a, size_t b) { return (a + b - 1) / b; }

} // namespace

Tiling::Place Tiling::placeOf(size_t tileNumber) const {
  const auto n = static_cast<int>(tileNumber), inLayer = columns * rows;
  const int within = n % inLayer;
  return {within % columns * tile.width, within / columns * tile.height, n / inLayer};
}

Tiling tilingOf(const TileShape& tile, size_t tiles, const TilingLimits& limits) {
  Tiling tiling{tile};
  if (tiles == 0) return tiling;
  for (int side = limits.side;; side *= 2) {
    side = std::min(side, limits.largestSide);
    const int columns = std::max(1, side / tile.width), rows = std::max(1, side / tile.height);
    const size_t layers = dividedUp(tiles, static_cast<size_t>(columns) * static_cast<size_t>(rows));
    if (layers > static_cast<size_t>(limits.layers)) {
      if (side == limits.largestSide)
        throw Error(std::to_string(tiles) + " tiles of " + std::to_string(tile.width) + " x " +
                    std::to_string(tile.height) + " texels do not fit into a texture");
      continue;
    }
    // Near squares that hold an equal share each.
    const size_t share = dividedUp(tiles, layers);
    const double across = std::sqrt(static_cast<double>(share) * tile.height / tile.width);
    tiling.columns = std::clamp(static_cast<int>(std::ceil(across)), 1, columns);
    tiling.rows = static_cast<int>(dividedUp(share, static_cast<size_t>(tiling.columns)));
    if (tiling.rows > rows) {
      tiling.columns = columns;
      tiling.rows = static_cast<int>(dividedUp(share, static_cast<size_t>(columns)));
    }
    tiling.layers = static_cast<int>(layers);
    return tiling;
  }
}

} // namespace surflect::lfm
