// Vectorised splatting, from a cloud to the depth layers of an image's pixels and their colours. All
// instruction sets with fused multiply-add give the same bits; others round a b + c twice.
#pragma once

#include "render/splat/footprint.h"

#include <cstddef>
#include <cstdint>

namespace surflect::splat {

// Shape of a splat, independent of its position.
struct SplatShape {
  float ax, ay, by;
  float peak, areaPeak; // areaPeak: peak times kAreaPeak
  float orderX, orderY, tolerance;
};

// A splat that is drawn: its Footprint in the form used by tiles. At (dx, dy) pixels from its centre the
// Gaussian is peak exp(-kCutoffSigmas^2 q / 2), where
//   q = (ax dx + ay dy)^2 + (by dy)^2 <= 1.
struct alignas(64) ScreenSplat {
  SplatShape shape;
  float x, y, order;
  uint32_t splat;
  PixelBox box; // pixels it may touch
};

// Input of the projection: an undistorted pinhole camera and a cloud, three floats per vector.
struct ProjectJob {
  const float *p, *u, *v;
  const int8_t* handedness;
  const float *radius, *coverage;
  double rotation[9]; // cameraFromWorld, row by row
  double translation[3];
  double focalX, focalY, centerX, centerY;
  int width, height;
  double sigmaPerRadius;
  float lowPass, nearDepth;
};

// Tiles have 32 x 32 pixels, in blocks of 4 x 4.
constexpr int kTileSize = 32;
constexpr int kBlockSize = 4;
constexpr int kBlocksPerRow = kTileSize / kBlockSize;
constexpr int kBlocks = kBlocksPerRow * kBlocksPerRow;
constexpr int kLanes = kBlockSize * kBlockSize; // pixels of a block, row by row

// A splat relative to the middle of a tile, where numbers are small. At (x, y) pixels from there
//   q = (a0 + ax x + ay y)^2 + (b0 + by y)^2,   order0 + orderX x + orderY y
struct TileSplat {
  SplatShape shape;
  float a0, b0, order0;
};

// Splats of a tile in groups of 64, and for each group and block the set of splats that reach the block:
// splat i is bit i % 64 of sets[i / 64 * kBlocks + block].
constexpr int kGroup = 64;
struct TileSplats {
  const TileSplat* splats;
  uint64_t* sets;
  uint32_t count;
};
constexpr uint32_t groupsOf(uint32_t splats) { return splats / kGroup + (splats % kGroup != 0 ? 1 : 0); }

// Blocks that splats may reach, one bit each, and the largest number of splats in a block.
struct PlacedSplats {
  uint64_t blocks;
  uint32_t most;
};

// Fragments of a block: for each splat of its set, kLanes orders and areas (NaN and 0 where the splat does
// not reach the pixel), its tolerance, and its index in the tile as the bits of a float. Arrays need room for
// kLanes entries more.
struct BlockFragments {
  float *orders, *areas, *tolerances, *splats;
};

// Fragments of one pixel, in the order of the tile. Arrays need room for 2 kLanes entries more than the block
// has splats.
struct PixelFragments {
  float *order, *tolerance, *area, *splat;
  float* rank;
};

// Layers of a block's pixels. The first layer is everything nearer than the limit; pixels not in `unresolved`
// show no other layer.
struct BlockLayers {
  float alpha[kLanes];
  float area[kLanes];  // area of the first layer
  float limit[kLanes]; // an order; no fragment is nearer if alpha is 0
  uint32_t unresolved; // one bit per pixel
  bool mayHide;        // true if there may be splats that no pixel shows
  uint32_t count;      // splats of the block
};

// Projects splats [begin, end) of the cloud as footprintOf does; returns the number drawn. `out` has room for
// all. Adds the numbers of rejected splats to `rejected`, indexed by Rejection.
size_t projectSplats(const ProjectJob&, size_t begin, size_t end, ScreenSplat* out, size_t* rejected);
// Places the splats entries[0 .. count) of `screen` in the tile with corner pixel (x, y). `sets` has room for
// whole groups; `column` receives their indices in the cloud.
PlacedSplats placeSplats(const ScreenSplat* screen, const uint32_t* entries, uint32_t count, int x, int y,
                         TileSplat* splats, uint64_t* sets, uint32_t* column);
// Computes the fragments of a block, removes from its set the splats that reach no pixel, and finds the first
// layer of each pixel where sums, without sorting, determine it. width, height: size of the tile; pixels
// outside are empty. searchLayers, keepsHidden: SplatOptions.
void resolveBlock(const TileSplats&, int block, int width, int height, bool searchLayers, bool keepsHidden,
                  const BlockFragments&, BlockLayers&);
// Collects the fragments of a pixel; returns their number. count: splats of the block.
uint32_t gatherPixel(uint32_t count, int lane, const BlockFragments&, const PixelFragments&);
// Writes to `rank`, for each fragment, the number of nearer fragments. Time is quadratic in the count.
void rankPixel(uint32_t count, const PixelFragments&);
// Removes from the block's set the splats that no pixel shows: those with no order below a pixel's limit.
void removeHiddenSplats(const TileSplats&, int block, const BlockFragments&, const float* limits);
// Sums 3 * triples values per splat over the fragments below the limits, with weights that sum to alpha.
// triples: 1 or 2. values: `triples` groups of four floats per splat, the first of three values and 1, the
// second of three values and an unused float; all are multiplied by the splat's peak and confidence. finite:
// true if all values are finite. out: kLanes sums for each value.
void blendBlock(const TileSplats&, int block, const float* limits, const float* alpha, const float* values,
                int triples, bool finite, float* out);
// Mean order of the fragments below the limits.
void meanOrder(const TileSplats&, int block, const float* limits, float* out);

} // namespace surflect::splat
