// Bins projected splats by the tiles that they touch.
#pragma once

#include "render/splat/splat.h"
#include "render/splat/splat_kernels.h"
#include "surfel/base/progress.h"
#include "surfel/base/scratch_buffer.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect::splat {

// Number of splats drawn, and of those rejected by reason; see Rejection.
struct SplatCounts {
  size_t drawn = 0, dead = 0, notFinite = 0, backFacing = 0, tooNear = 0, outside = 0;
};

// Tiles under a splat: from (x0, y0) to (x1, y1), both included.
struct TileRange {
  uint16_t x0, y0, x1, y1;
};

struct TileBins {
  SplatCounts counts;
  ScratchBuffer<ScreenSplat> screen; // drawn splats, with gaps
  ScratchBuffer<TileRange> ranges;   // tiles of each drawn splat, so that filling need not read splats again
  ScratchBuffer<uint32_t> entries;   // indices in `screen`, tile by tile, each in the order of the cloud
  std::vector<size_t> begin;
  std::vector<uint32_t> counters; // working memory of the sort

  std::span<const uint32_t> of(size_t tile) const {
    return {entries.data() + begin[tile], entries.data() + begin[tile + 1]};
  }
};

// Projects the cloud into tiles of kTileSize pixels, row by row. Memory: 72 bytes for each drawn splat, and 4
// for each tile it touches.
void fillTiles(const capture::Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options,
               const Progress& progress, TileBins& bins);

inline int tilesAlong(int pixels) { return (pixels + kTileSize - 1) / kTileSize; }

} // namespace surflect::splat
