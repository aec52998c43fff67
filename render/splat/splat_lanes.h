// What the loops of splatting share.
#pragma once

#include "render/splat/splat_kernels.h"
#include "surfel/math/lanes.h"

namespace surflect::splat {
namespace {

constexpr float kHuge = 3.0e38f;
constexpr float kInfinity = __builtin_inff();
constexpr float kNotANumber = __builtin_nanf("");
constexpr float kCutoff = static_cast<float>(kCutoffSigmas);

inline int ones(Mask m) { return __builtin_popcount(bitsOf(m)); }
inline Lanes absolute(Lanes a) { return max(a, broadcast(0) - a); }

inline uint32_t roundedUp(uint32_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

// The first `count` lanes.
inline Mask firstLanes(int count) {
  float lane[kLanes];
  for (int i = 0; i < kLanes; ++i) lane[i] = static_cast<float>(i);
  return load(lane) < broadcast(static_cast<float>(count));
}

// Calls visit(splat of the tile) for the block's set, in order.
template <class Visit> inline void eachSplat(const TileSplats& tile, int block, Visit visit) {
  const uint32_t groups = groupsOf(tile.count);
  for (uint32_t g = 0; g < groups; ++g)
    for (uint64_t left = tile.sets[g * kBlocks + block]; left != 0; left &= left - 1)
      visit(g * kGroup + __builtin_ctzll(left));
}
// Takes from the set those for which keep(splat of the tile) is false.
template <class Keep> inline void keepSplats(const TileSplats& tile, int block, Keep keep) {
  const uint32_t groups = groupsOf(tile.count);
  for (uint32_t g = 0; g < groups; ++g) {
    uint64_t kept = 0;
    for (uint64_t left = tile.sets[g * kBlocks + block]; left != 0; left &= left - 1) {
      const uint32_t bit = __builtin_ctzll(left);
      kept |= uint64_t{keep(g * kGroup + bit)} << bit; // without a branch
    }
    tile.sets[g * kBlocks + block] = kept;
  }
}

// Pixel centres of a block, from the middle of its tile.
struct Centers {
  Lanes x, y;
};
inline Centers centersOf(int block) {
  float x[kLanes], y[kLanes];
  const int x0 = block % kBlocksPerRow * kBlockSize, y0 = block / kBlocksPerRow * kBlockSize;
  for (int i = 0; i < kLanes; ++i) {
    x[i] = static_cast<float>(x0 + i % kBlockSize - kTileSize / 2) + 0.5f;
    y[i] = static_cast<float>(y0 + i / kBlockSize - kTileSize / 2) + 0.5f;
  }
  return {load(x), load(y)};
}

// How far inside of its cut-off a splat has the pixels: 1 at its centre, below 0 beyond.
inline Lanes insideOf(const TileSplat& s, const Centers& at) {
  const SplatShape& shape = s.shape;
  const Lanes a = mulAdd(broadcast(shape.ax), at.x, mulAdd(broadcast(shape.ay), at.y, broadcast(s.a0)));
  const Lanes b = mulAdd(broadcast(shape.by), at.y, broadcast(s.b0));
  return negMulAdd(a, a, negMulAdd(b, b, broadcast(1)));
}
inline Lanes orderOf(const TileSplat& s, const Centers& at) {
  const SplatShape& shape = s.shape;
  return mulAdd(broadcast(shape.orderX), at.x, mulAdd(broadcast(shape.orderY), at.y, broadcast(s.order0)));
}

inline Lanes saturatedLanes(Lanes area) {
  return min(max((area - broadcast(1 - kFull)) / broadcast(2 * kFull - 1), broadcast(0)), broadcast(1));
}

} // namespace
} // namespace surflect::splat
