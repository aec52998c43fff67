// Splats of one tile of the image, and the layers that its pixels show.
#pragma once

#include "render/splat/pixel_layers.h"
#include "render/splat/splat_kernels.h"
#include "surfel/base/scratch_buffer.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::splat {

// Depth layer of a pixel that has several. For such pixels the splats' weights are stored, as contributions.
struct PixelLayer {
  uint32_t pixel;        // index in the tile, row by row
  uint32_t begin, count; // range in RasterTile::contributions
  float alpha;           // 0 if the layer is hidden and kept by SplatOptions::keepsHidden
  float area;            // of the layer alone
  float order;           // weighted mean of the splats'
  bool isMedian;         // true if half of the pixel's alpha is reached in this layer
};
struct Contribution {
  uint32_t splat; // index in the tile
  float weight;   // without the splat's peak
};

struct RasterTile {
  TileSplats drawn = {};
  uint64_t blocks = 0;             // blocks with splats, one bit each
  ScratchBuffer<TileSplat> splats; // data of drawn.splats
  ScratchBuffer<uint64_t> sets;    // data of drawn.sets
  ScratchBuffer<uint32_t>
      column; // index of each splat in the cloud; after rasterizing, index in SplatRaster::visible
  ScratchBuffer<float> limits;    // kLanes per block
  std::vector<PixelLayer> layers; // of pixels that show several
  std::vector<Contribution> contributions;
};

// Pixels of the image that a tile covers.
struct TileFrame {
  int x0, y0, width, height;
};

// Calls visit(lane, x, y, count) for each row of a block: `count` image pixels from (x, y) on.
template <class Visit> void forRows(const TileFrame& frame, int block, Visit visit) {
  const int x = block % kBlocksPerRow * kBlockSize, y0 = block / kBlocksPerRow * kBlockSize;
  const int count = frame.width - x < kBlockSize ? frame.width - x : kBlockSize;
  const int rows = frame.height - y0 < kBlockSize ? frame.height - y0 : kBlockSize;
  for (int row = 0; count > 0 && row < rows; ++row)
    visit(static_cast<size_t>(row * kBlockSize), frame.x0 + x, frame.y0 + y0 + row,
          static_cast<size_t>(count));
}

// Copies a row of a block.
inline void copyRow(const float* from, size_t count, float* to) {
  if (count == kBlockSize) {
    std::copy_n(from, kBlockSize, to); // a constant length, which needs no call
  } else {
    std::copy_n(from, count, to);
  }
}

// Sums for all pixels of an image, row by row.
struct PixelSums {
  float *alpha, *layerArea;
  size_t width;
};

// Working memory that is reused from tile to tile.
struct TileScratch {
  ScratchBuffer<uint64_t> seen;                             // visible splats, one set per group
  ScratchBuffer<float> orders, areas, tolerances, splats;   // for BlockFragments
  ScratchBuffer<float> order, tolerance, area, splat, rank; // for PixelFragments
  std::vector<Fragment> fragments;                          // fragments of one pixel
  std::vector<Layer> layers;
};

// Rasterizes the splats `entries` of `screen` into a tile. Writes the tile and its pixels of `pixels`, and
// marks the visible splats of the cloud in `seen`, which other threads may mark at the same time. Pixels of
// blocks that are not in tile.blocks must be 0 before the call, and are 0 after it. searchLayers,
// keepsHidden: SplatOptions.
void rasterizeTile(const ScreenSplat* screen, std::span<const uint32_t> entries, const TileFrame& frame,
                   bool searchLayers, bool keepsHidden, TileScratch& scratch, RasterTile& tile,
                   const PixelSums& pixels, std::span<uint8_t> seen);

} // namespace surflect::splat
