// The splats of one tile of a picture, and what its pixels show of them.
#pragma once

#include "render/splat/pixel_layers.h"
#include "render/splat/splat_kernels.h"
#include "surfel/base/scratch_buffer.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::splat {

// One of several layers that a pixel shows, which has its row of the matrix.
struct PixelLayer {
  uint32_t pixel;        // of the tile, row by row
  uint32_t begin, count; // of the contributions
  float alpha;
  float order;   // mean
  bool isMiddle; // the pixel's layer at half of its alpha
};
struct Contribution {
  uint32_t splat; // of the tile
  float weight;   // but for the splat's peak
};

struct RasterTile {
  TileSplats drawn;
  uint64_t blocks;                 // where they are, a bit for each
  ScratchBuffer<TileSplat> splats; // what `drawn` points at
  ScratchBuffer<uint64_t> sets;    // likewise
  ScratchBuffer<uint32_t>
      column; // of each splat its number in the cloud, and after covering in Coverage::visible
  ScratchBuffer<float> limits;    // kLanes for each block
  std::vector<PixelLayer> layers; // of pixels that show several
  std::vector<Contribution> contributions;
};

// The pixels of a picture that a tile has.
struct TileFrame {
  int x0, y0, width, height;
};

// Calls visit(lane, x, y, count) for the rows of a block: `count` pixels of the picture from (x, y) on.
template <class Visit> void forRows(const TileFrame& frame, int block, Visit visit) {
  const int x = block % kBlocksPerRow * kBlockSize, y0 = block / kBlocksPerRow * kBlockSize;
  const int count = frame.width - x < kBlockSize ? frame.width - x : kBlockSize;
  const int rows = frame.height - y0 < kBlockSize ? frame.height - y0 : kBlockSize;
  for (int row = 0; count > 0 && row < rows; ++row)
    visit(static_cast<size_t>(row * kBlockSize), frame.x0 + x, frame.y0 + y0 + row,
          static_cast<size_t>(count));
}

// Of a row of a block.
inline void copyRow(const float* from, size_t count, float* to) {
  if (count == kBlockSize) {
    std::copy_n(from, kBlockSize, to); // without a call
  } else {
    std::copy_n(from, count, to);
  }
}

// Of a whole picture, row by row.
struct PixelSums {
  float *alpha, *layerArea;
  size_t width;
};

// Reused from tile to tile.
struct TileScratch {
  ScratchBuffer<uint64_t> seen;                             // of each group the set
  ScratchBuffer<float> orders, areas, tolerances, splats;   // BlockFragments
  ScratchBuffer<float> order, tolerance, area, splat, rank; // PixelFragments
  std::vector<Fragment> fragments;                          // of a pixel
  std::vector<Layer> layers;
};

// Covers a tile with the splats `entries` of `screen`. Sets what the frame has of the pixels and all of the
// tile, and marks in `seen` which splats of the cloud are visible; other threads may do so too.
void rasterizeTile(const ScreenSplat* screen, std::span<const uint32_t> entries, const TileFrame& frame,
                   TileScratch& scratch, RasterTile& tile, const PixelSums& pixels, std::span<uint8_t> seen);

} // namespace surflect::splat
