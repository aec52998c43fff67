// Vectors over the pixels of a block, one pixel per lane, for Highway kernels: included once for each
// instruction set.
#if defined(RENDER_SPLAT_PIXELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef RENDER_SPLAT_PIXELS_INL_H
#undef RENDER_SPLAT_PIXELS_INL_H
#else
#define RENDER_SPLAT_PIXELS_INL_H
#endif

#include "render/splat/splat_kernels.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::splat {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using PixelTag = hn::CappedTag<float, kLanes>;
constexpr PixelTag kFloats;
constexpr int kVectorLanes = static_cast<int>(hn::MaxLanes(PixelTag()));
constexpr int kVectors = kLanes / kVectorLanes;

constexpr float kHuge = 3.0e38f;
constexpr float kInfinity = __builtin_inff();
constexpr float kNotANumber = __builtin_nanf("");
constexpr float kCutoff = static_cast<float>(kCutoffSigmas);

struct Pixels {
  hn::Vec<PixelTag> v[kVectors];
};
struct PixelMask {
  hn::Mask<PixelTag> m[kVectors];
};

template <class Operation> HWY_INLINE Pixels eachVector(const Operation& operation) {
  Pixels result;
  for (int k = 0; k < kVectors; ++k) result.v[k] = operation(k);
  return result;
}
template <class Test> HWY_INLINE PixelMask eachMask(const Test& test) {
  PixelMask result;
  for (int k = 0; k < kVectors; ++k) result.m[k] = test(k);
  return result;
}

HWY_INLINE Pixels load(const float* from) {
  return eachVector([&](int k) HWY_ATTR { return hn::LoadU(kFloats, from + k * kVectorLanes); });
}
HWY_INLINE Pixels broadcast(float x) {
  return eachVector([&](int) HWY_ATTR { return hn::Set(kFloats, x); });
}
HWY_INLINE void store(float* to, const Pixels& a) {
  for (int k = 0; k < kVectors; ++k) hn::StoreU(a.v[k], kFloats, to + k * kVectorLanes);
}
HWY_INLINE Pixels operator+(const Pixels& a, const Pixels& b) {
  return eachVector([&](int k) HWY_ATTR { return a.v[k] + b.v[k]; });
}
HWY_INLINE Pixels operator-(const Pixels& a, const Pixels& b) {
  return eachVector([&](int k) HWY_ATTR { return a.v[k] - b.v[k]; });
}
HWY_INLINE Pixels operator*(const Pixels& a, const Pixels& b) {
  return eachVector([&](int k) HWY_ATTR { return a.v[k] * b.v[k]; });
}
HWY_INLINE Pixels operator/(const Pixels& a, const Pixels& b) {
  return eachVector([&](int k) HWY_ATTR { return a.v[k] / b.v[k]; });
}
HWY_INLINE Pixels mulAdd(const Pixels& a, const Pixels& b, const Pixels& c) {
  return eachVector([&](int k) HWY_ATTR { return hn::MulAdd(a.v[k], b.v[k], c.v[k]); });
}
// c - a b
HWY_INLINE Pixels negMulAdd(const Pixels& a, const Pixels& b, const Pixels& c) {
  return eachVector([&](int k) HWY_ATTR { return hn::NegMulAdd(a.v[k], b.v[k], c.v[k]); });
}
// Minimum; b where a is NaN.
HWY_INLINE Pixels min(const Pixels& a, const Pixels& b) {
  return eachVector([&](int k) HWY_ATTR { return hn::Min(a.v[k], b.v[k]); });
}
HWY_INLINE Pixels max(const Pixels& a, const Pixels& b) {
  return eachVector([&](int k) HWY_ATTR { return hn::Max(a.v[k], b.v[k]); });
}
HWY_INLINE PixelMask operator<(const Pixels& a, const Pixels& b) {
  return eachMask([&](int k) HWY_ATTR { return a.v[k] < b.v[k]; });
}
HWY_INLINE PixelMask operator<=(const Pixels& a, const Pixels& b) {
  return eachMask([&](int k) HWY_ATTR { return a.v[k] <= b.v[k]; });
}
HWY_INLINE PixelMask operator&(const PixelMask& a, const PixelMask& b) {
  return eachMask([&](int k) HWY_ATTR { return hn::And(a.m[k], b.m[k]); });
}
// a and not b
HWY_INLINE PixelMask andNot(const PixelMask& a, const PixelMask& b) {
  return eachMask([&](int k) HWY_ATTR { return hn::AndNot(b.m[k], a.m[k]); });
}
HWY_INLINE Pixels select(const PixelMask& m, const Pixels& a, const Pixels& b) {
  return eachVector([&](int k) HWY_ATTR { return hn::IfThenElse(m.m[k], a.v[k], b.v[k]); });
}
// a where m is set, else 0.
HWY_INLINE Pixels where(const PixelMask& m, const Pixels& a) {
  return eachVector([&](int k) HWY_ATTR { return hn::IfThenElseZero(m.m[k], a.v[k]); });
}
// Bit i is that of lane i.
HWY_INLINE uint32_t bitsOf(hn::Mask<PixelTag> mask) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(kFloats, mask, bytes);
  return bytes[0] | uint32_t{bytes[1]} << 8;
}
HWY_INLINE uint32_t bitsOf(const PixelMask& m) {
  uint32_t bits = 0;
  for (int k = 0; k < kVectors; ++k) bits |= bitsOf(m.m[k]) << k * kVectorLanes;
  return bits;
}
HWY_INLINE int ones(const PixelMask& m) { return __builtin_popcount(bitsOf(m)); }
HWY_INLINE bool any(const PixelMask& m) { return bitsOf(m) != 0; }

// Calls visit(splat of the tile) for each splat of the block's set, in order.
template <class Visit> HWY_INLINE void eachSplat(const TileSplats& tile, int block, Visit visit) {
  const uint32_t groups = groupsOf(tile.count);
  for (uint32_t g = 0; g < groups; ++g)
    for (uint64_t left = tile.sets[g * kBlocks + block]; left != 0; left &= left - 1)
      visit(g * kGroup + __builtin_ctzll(left));
}
// Removes the splats from the block's set for which keep(splat of the tile) is false.
template <class Keep> HWY_INLINE void keepSplats(const TileSplats& tile, int block, Keep keep) {
  const uint32_t groups = groupsOf(tile.count);
  for (uint32_t g = 0; g < groups; ++g) {
    uint64_t kept = 0;
    for (uint64_t left = tile.sets[g * kBlocks + block]; left != 0; left &= left - 1) {
      const uint32_t bit = __builtin_ctzll(left);
      kept |= uint64_t{keep(g * kGroup + bit)} << bit; // branchless
    }
    tile.sets[g * kBlocks + block] = kept;
  }
}

// Pixel centres of a block, relative to the middle of its tile.
struct Centers {
  Pixels x, y;
};
HWY_INLINE Centers centersOf(int block) {
  float x[kLanes], y[kLanes];
  const int x0 = block % kBlocksPerRow * kBlockSize, y0 = block / kBlocksPerRow * kBlockSize;
  for (int i = 0; i < kLanes; ++i) {
    x[i] = static_cast<float>(x0 + i % kBlockSize - kTileSize / 2) + 0.5f;
    y[i] = static_cast<float>(y0 + i / kBlockSize - kTileSize / 2) + 0.5f;
  }
  return {load(x), load(y)};
}

// Returns 1 - q at the pixels: 1 at the splat's centre, 0 at its cut-off, negative beyond.
HWY_INLINE Pixels insideOf(const TileSplat& s, const Centers& at) {
  const SplatShape& shape = s.shape;
  const Pixels a = mulAdd(broadcast(shape.ax), at.x, mulAdd(broadcast(shape.ay), at.y, broadcast(s.a0)));
  const Pixels b = mulAdd(broadcast(shape.by), at.y, broadcast(s.b0));
  return negMulAdd(a, a, negMulAdd(b, b, broadcast(1)));
}
HWY_INLINE Pixels orderOf(const TileSplat& s, const Centers& at) {
  const SplatShape& shape = s.shape;
  return mulAdd(broadcast(shape.orderX), at.x, mulAdd(broadcast(shape.orderY), at.y, broadcast(s.order0)));
}

HWY_INLINE Pixels saturated(Pixels area) {
  return min(max((area - broadcast(1 - kOpaqueArea)) / broadcast(2 * kOpaqueArea - 1), broadcast(0)),
             broadcast(1));
}

} // namespace HWY_NAMESPACE
} // namespace surflect::splat
HWY_AFTER_NAMESPACE();

#endif
