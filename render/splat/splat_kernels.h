// Splatting in vector instructions: from a cloud to the layers of a picture's pixels, and their colours.
// Every instruction set with fused multiplication gives the same bits; without, a b + c is rounded twice.
#pragma once

#include "render/splat/footprint.h"

#include <cstddef>
#include <cstdint>

namespace surflect::splat {

// What a splat is wherever it lies.
struct SplatShape {
  float ax, ay, by;
  float peak, areaPeak; // the latter times kAreaPeak
  float orderX, orderY, tolerance;
};

// One of a cloud's splats that is drawn: a Footprint made ready for tiles. At (dx, dy) pixels from its centre
// its Gaussian is peak exp(-kCutoffSigmas^2 q / 2) where
//   q = (ax dx + ay dy)^2 + (by dy)^2 <= 1.
struct alignas(64) ScreenSplat {
  SplatShape shape;
  float x, y, order;
  uint32_t splat;
  PixelBox box; // what it may touch
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
  SplatShape shape;
  float a0, b0, order0;
};

// A tile's splats, 64 to a group, and for each group and block the set of those that reach the block: of
// splat i bit i % 64 of sets[i / 64 * kBlocks + block].
constexpr int kGroup = 64;
struct TileSplats {
  const TileSplat* splats;
  uint64_t* sets;
  uint32_t count;
};
constexpr uint32_t groupsOf(uint32_t splats) { return splats / kGroup + (splats % kGroup != 0 ? 1 : 0); }

// What splats do in the pixels of a block: kLanes orders and areas for each of its set, no number and 0 where
// the splat does not reach, the tolerance, and which of the tile's splats it is, as the bits of a float. Room
// for kLanes more.
struct BlockFragments {
  float *orders, *areas, *tolerances, *splats;
};

// What splats do in one pixel, in their order in the tile. Room for 2 kLanes more than the block has.
struct PixelFragments {
  float *order, *tolerance, *area, *splat;
  float* rank;
};

// The pixels of a block. Their first layer is all that is nearer than the limit, and all there is to them but
// for `unresolved`.
struct BlockLayers {
  float alpha[kLanes];
  float area[kLanes];  // of the layer
  float limit[kLanes]; // an order; nothing is nearer where alpha is 0
  uint32_t unresolved; // a bit for each pixel
  bool mayHide;        // there may be splats that no pixel shows
  uint32_t count;      // of the block's splats
};

// Splats [begin, end) of the cloud as footprintOf has them; returns how many are drawn. out: room for all.
// rejected: counts by Rejection, added to.
size_t projectSplats(const ProjectJob&, size_t begin, size_t end, ScreenSplat* out, size_t* rejected);
// Makes the splats entries[0 .. count) of `screen` ready for the tile whose corner is the pixel (x, y);
// returns how many a block has at most. sets: room for whole groups. column: their numbers in the cloud.
uint32_t placeSplats(const ScreenSplat* screen, const uint32_t* entries, uint32_t count, int x, int y,
                     TileSplat* splats, uint64_t* sets, uint32_t* column);
// Fills the fragments of a block, takes from its set what reaches none of its pixels, and finds the first
// layer of each pixel as far as that is told from sums. width, height: of the tile; there is nothing in
// pixels beyond.
void resolveBlock(const TileSplats&, int block, int width, int height, const BlockFragments&, BlockLayers&);
// The fragments of a pixel; returns how many. count: of the block's splats.
uint32_t gatherPixel(uint32_t count, int lane, const BlockFragments&, const PixelFragments&);
// How many fragments are nearer than each, as `rank`. Time grows with the square of the count.
void rankPixel(uint32_t count, const PixelFragments&);
// Takes from the block's set what has no order below a limit.
void keepSeen(const TileSplats&, int block, const BlockFragments&, const float* limits);
// Sums of 3 * triples values per splat of the tile over the fragments below the limits, weighted to sum to
// alpha. triples: 1 or 2. values: for each splat `triples` groups of four floats, of which the first group
// is three values and 1, the second three values and one float that is not read; all times the splat's peak
// and confidence. finite: whether all values are. out: kLanes sums for each of the values.
void blendBlock(const TileSplats&, int block, const float* limits, const float* alpha, const float* values,
                int triples, bool finite, float* out);
// The mean order of these fragments.
void meanOrder(const TileSplats&, int block, const float* limits, float* out);

} // namespace surflect::splat
