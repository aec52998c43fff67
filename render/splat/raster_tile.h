// Splats of one tile of the image, and the layers that its pixels show.
#pragma once

#include "render/splat/splat_kernels.h"
#include "surfel/base/memory.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::splat {

// Depth layers of a pixel: overlapping splats are grouped into surfaces, which fill the pixel front to back.

// A splat at a pixel. Colour is weighted by peak exp(-q), which is narrower by sqrt 2 than the splat's
// Gaussian exp(-q/2) and therefore blurs less. Its sum over splats is not 1, but weights are divided by their
// sum. Covered area is spread by a kernel that has the mass of the splat's Gaussian but is wider. Its sum
// over splats hardly ripples, even if the cloud lacks a surfel, and the area of a tiny splat is right at any
// position within a pixel.
struct Fragment {
  float order, tolerance, area;
  uint32_t splat; // index in the tile
};

struct Layer {
  size_t begin, end; // range of the sorted fragments
  float area;
  float alpha; // opacity of all layers up to this one, minus that of the layers before it
};

// Opacity of a covered area; see kOpaqueArea.
float saturated(float area);

// Divides the fragments of a pixel, sorted by depth from the nearest, into layers. Stops after the layer that
// fills the pixel, unless keepsHidden: the layers behind it then have alpha 0.
//
// A layer ends where the depth interval of the next fragment no longer touches those of the layer. Areas are
// fractions of one pixel and add up over layers: with S_k the area of layers 1 to k, layer k has the opacity
//   alpha_k = saturated(S_k) - saturated(S_(k-1)),
// shared among its fragments by weight and confidence. A surface behind an edge fills exactly the part of the
// pixel that the edge leaves open, and a surface split into two layers (grazing, creased or noisy) still adds
// up to 1. In both cases the usual compositing, in which layer k adds (1 - alpha so far) alpha_k, would let
// the background shine through.
void layersOf(const std::vector<Fragment>& fragments, bool keepsHidden, std::vector<Layer>& layers);

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

// The splat of the largest weight at pixel (x, y) of the tile, as its entry in `column`; empty if the pixel
// shows none.
std::optional<uint32_t> heaviestSplat(const RasterTile& tile, int x, int y);

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
