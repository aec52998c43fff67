// The loops of splatting that run in lanes, compiled for each kind of vector instructions. Raw pointers only:
// see surfel/simd.h. avx2 and avx512 give the same bits; scalar rounds a b + c twice.
#pragma once

#include "render/footprint.h"

#include <cstddef>
#include <cstdint>

namespace surflect {

// One of a cloud's splats that is drawn: a Footprint made ready for tiles. At (dx, dy) pixels from its centre
// its Gaussian is peak exp(-kCutoffSigmas^2 q / 2) where
//   q = (ax dx + ay dy)^2 + (by dy)^2 <= 1.
struct alignas(64) ScreenSplat {
  float x, y;
  float ax, ay, by;
  float peak;
  float order, orderX, orderY, tolerance;
  PixelBox box; // what it may touch
  uint32_t splat;
};

// What projecting reads: an undistorted pinhole camera and a cloud, three floats to a vector.
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

// Tiles are of 32 x 32 pixels, in blocks of 4 x 4.
constexpr int kTileSize = 32;
constexpr int kBlockSize = 4;
constexpr int kBlocksPerRow = kTileSize / kBlockSize;
constexpr int kBlocks = kBlocksPerRow * kBlocksPerRow;
constexpr int kLanes = kBlockSize * kBlockSize; // pixels of a block, row by row

// A splat about a tile's middle, where numbers are small. At (x, y) pixels from there
//   q = (a0 + ax x + ay y)^2 + (b0 + by y)^2,   order0 + orderX x + orderY y
struct TileSplat {
  float a0, ax, ay, b0, by;
  float peak;
  float order0, orderX, orderY, tolerance;
  uint8_t blockX0, blockY0, blockX1, blockY1; // blocks it may touch: [X0, X1) x [Y0, Y1)
};

// A tile's splats, and which of them reach each of its blocks: list[begin[b] .. end[b]).
struct TileLists {
  const TileSplat* splats;
  uint32_t count;
  uint32_t* list; // room for one more
  uint32_t begin[kBlocks], end[kBlocks];
};

// What splats do in the pixels of a block: kLanes orders and areas for each entry of its list, no number and
// 0 where the splat does not reach, a bit for each pixel that it reaches, and the tolerance. Room for kLanes
// entries more than the list has.
struct BlockFragments {
  float *orders, *areas, *tolerances;
  uint32_t* reached;
};

// What splats do in one pixel, in the order of the block's list. Room for 2 kLanes more than that has.
struct PixelFragments {
  float *order, *tolerance, *area;
  float* work; // of kernels
};

// The pixels of a block. Their first layer is all that is nearer than the limit, and all there is to them but
// for `unresolved`.
struct BlockLayers {
  float alpha[kLanes];
  float area[kLanes];  // of the layer
  float limit[kLanes]; // an order; nothing is nearer where alpha is 0
  uint32_t unresolved; // a bit for each pixel
};

struct SplatKernels {
  // Splats [begin, end) of the cloud as footprintOf has them; returns how many are drawn. out: room for all.
  // rejected: counts by Rejection, added to.
  size_t (*project)(const ProjectJob&, size_t begin, size_t end, ScreenSplat* out, size_t* rejected);
  // Fills list, begin and end.
  void (*listBlocks)(TileLists&);
  // Takes from the block's list what is hidden from all its pixels, as far as that is told from their sums,
  // and fills the fragments of the others. width, height: of the tile; there is nothing in pixels beyond.
  void (*resolveBlock)(TileLists&, int block, int width, int height, const BlockFragments&, BlockLayers&);
  // The fragments of a pixel; returns how many. count: the length of the block's list.
  uint32_t (*gatherPixel)(uint32_t count, int lane, const BlockFragments&, const PixelFragments&);
  // For an unresolved pixel: whether its first layer is all there is to it, and then its entries in `layers`.
  // Time grows with the square of the count.
  bool (*firstLayer)(uint32_t count, const PixelFragments&, int lane, BlockLayers& layers);
  // How many fragments are nearer than each, as numbers in `work`. Time as above.
  void (*rankPixel)(uint32_t count, const PixelFragments&);
  // Marks seen[splat of the tile] of those with an order below a limit; drops the others from the block's
  // list.
  void (*keepSeen)(TileLists&, int block, const BlockFragments&, const float* limits, uint8_t* seen);
  // Sums of three values per splat of the tile over the fragments below the limits, weighted to sum to alpha.
  // values: three and the confidence of each splat. finite: all values are. out: 3 x kLanes.
  void (*blendBlock)(const TileLists&, int block, const float* limits, const float* alpha,
                     const float* values, bool finite, float* out);
  // The mean order of these fragments.
  void (*meanOrder)(const TileLists&, int block, const float* limits, float* out);
};

enum class Simd;
const SplatKernels& splatKernels(Simd simd);

} // namespace surflect
