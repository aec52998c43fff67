#include "render/splat/splat_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/splat/blend_kernel.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include "render/splat/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace surflect::splat {
namespace HWY_NAMESPACE {
namespace {

// Colour weight exp(-q) for q = (1 - t) kCutoffSigmas^2, t from 0 to 1, with a relative error of 8e-6: a
// power of two, times the interpolant at five Chebyshev points for the remaining fraction. hn::Exp would make
// blending 1.35 times slower.
HWY_INLINE hn::Vec<PixelTag> colorWeight(hn::Vec<PixelTag> t) {
  const auto number = [](float x) HWY_ATTR { return hn::Set(kFloats, x); };
  constexpr float scale = 17.673014f; // kCutoffSigmas^2 over ln 2
  const auto power = hn::MulSub(t, number(scale), number(scale)), whole = Round(power), x = power - whole;
  auto p = MulAdd(number(0.00966636852f), x, number(0.0559219758f));
  p = MulAdd(p, x, number(0.240223490f));
  p = MulAdd(p, x, number(0.693121045f));
  p = MulAdd(p, x, number(1.00000000f));
  const hn::RebindToSigned<PixelTag> kInts;
  const auto exponent = hn::ShiftLeft<23>(hn::ConvertTo(kInts, whole));
  return hn::BitCast(kFloats, hn::BitCast(kInts, p) + exponent);
}
HWY_INLINE Pixels colorWeight(const Pixels& t) {
  return eachVector([&](int k) HWY_ATTR { return colorWeight(t.v[k]); });
}

// Returns true if each pixel of a block shows either all splats of the block's set or none; orders then need
// not be compared.
HWY_INLINE bool showAllOrNothing(Pixels limit) {
  const Pixels infinite = broadcast(kInfinity);
  return !any((broadcast(0) - infinite < limit) & (limit < infinite));
}

// Calls add(splat of the tile, mask of the pixels that show it, weights without its peak, orders) for each
// splat of a block. If not `ordered`, pixels show every splat that reaches them, and orders are 0.
template <bool ordered, class Add>
HWY_INLINE void eachWeight(const TileSplats& tile, int block, Pixels limit, Add add) {
  const Centers at = centersOf(block);
  const Pixels zero = broadcast(0);
  eachSplat(tile, block, [&](uint32_t splat) HWY_ATTR {
    const TileSplat& s = tile.splats[splat];
    const Pixels inside = insideOf(s, at), weight = colorWeight(inside);
    if constexpr (ordered) {
      const Pixels order = orderOf(s, at);
      add(splat, (zero <= inside) & (order < limit), weight, order);
    } else {
      add(splat, zero <= inside, weight, zero);
    }
  });
}

// Implements blendBlock of splat_kernels.h. If not `ordered`, pixels show all splats or none.
template <int triples, bool ordered, bool finite>
HWY_INLINE void blendBlockAs(const TileSplats& tile, int block, const float* limits, const float* alpha,
                             const float* values, float* out) {
  const Pixels zero = broadcast(0), limit = load(limits);
  Pixels sum = zero, sums[3 * triples];
  for (Pixels& s : sums) s = zero;
  eachWeight<ordered>(tile, block, limit, [&](uint32_t splat, PixelMask in, Pixels weight, Pixels) HWY_ATTR {
    const float* value = values + 4 * triples * static_cast<size_t>(splat);
    const Pixels seen = where(in, weight);
    sum = mulAdd(seen, broadcast(value[3]), sum);
    for (int k = 0; k < 3 * triples; ++k) {
      const Pixels next = mulAdd(seen, broadcast(value[k / 3 * 4 + k % 3]), sums[k]);
      // Pixels that do not show a non-finite value keep their sum, since 0 times the value is NaN.
      sums[k] = finite ? next : select(in, next, sums[k]);
    }
  });
  const PixelMask any = (zero < sum) & (zero - broadcast(kInfinity) < limit);
  const Pixels scale = load(alpha) / select(any, sum, broadcast(1));
  for (int k = 0; k < 3 * triples; ++k) store(out + k * kLanes, where(any, sums[k] * scale));
}

template <int triples>
HWY_INLINE void blendTriples(const TileSplats& tile, int block, const float* limits, const float* alpha,
                             const float* values, bool finite, float* out) {
  if (!finite) {
    blendBlockAs<triples, true, false>(tile, block, limits, alpha, values, out);
  } else if (showAllOrNothing(load(limits))) {
    blendBlockAs<triples, false, true>(tile, block, limits, alpha, values, out);
  } else {
    blendBlockAs<triples, true, true>(tile, block, limits, alpha, values, out);
  }
}

void blendBlock(const TileSplats& tile, int block, const float* limits, const float* alpha,
                const float* values, int triples, bool finite, float* out) {
  (triples == 2 ? blendTriples<2> : blendTriples<1>)(tile, block, limits, alpha, values, finite, out);
}

void meanOrder(const TileSplats& tile, int block, const float* limits, float* out) {
  const Pixels zero = broadcast(0);
  Pixels sum = zero, sumOfOrders = zero;
  eachWeight<true>(tile, block, load(limits),
                   [&](uint32_t splat, PixelMask in, Pixels weight, Pixels order) HWY_ATTR {
                     const Pixels seen = where(in, weight * broadcast(tile.splats[splat].shape.peak));
                     sum = sum + seen;
                     sumOfOrders = mulAdd(seen, order, sumOfOrders);
                   });
  store(out, sumOfOrders / select(zero < sum, sum, broadcast(1)));
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::splat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::splat {

HWY_EXPORT(blendBlock);
void blendBlock(const TileSplats& tile, int block, const float* limits, const float* alpha,
                const float* values, int triples, bool finite, float* out) {
  HWY_DYNAMIC_DISPATCH(blendBlock)(tile, block, limits, alpha, values, triples, finite, out);
}

HWY_EXPORT(meanOrder);
void meanOrder(const TileSplats& tile, int block, const float* limits, float* out) {
  HWY_DYNAMIC_DISPATCH(meanOrder)(tile, block, limits, out);
}
} // namespace surflect::splat
#endif
