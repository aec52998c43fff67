// Blending: weighted sums over the fragments of a block's pixels.
#pragma once

#include "render/splat/splat_lanes.h"

namespace surflect::splat {
namespace {

// The colour weight exp(-q) for q = (1 - t) kCutoffSigmas^2, t from 0 to 1, within 8e-6 of itself: two to the
// nearest whole power, and of the rest the interpolant at five Chebyshev points.
inline Lanes colorWeight(Lanes t) {
  constexpr float scale = 17.673014f; // kCutoffSigmas^2 over ln 2
  const Lanes power = mulAdd(t, broadcast(scale), broadcast(-scale));
  const Lanes whole = nearestWhole(power), x = power - whole;
  Lanes p = mulAdd(broadcast(0.00966636852f), x, broadcast(0.0559219758f));
  p = mulAdd(p, x, broadcast(0.240223490f));
  p = mulAdd(p, x, broadcast(0.693121045f));
  p = mulAdd(p, x, broadcast(1.00000000f));
  return timesPowerOfTwo(p, whole);
}

// Whether each pixel of a block shows all of the block's set, or nothing: orders then need not be compared.
inline bool showAllOrNothing(Lanes limit) {
  const Lanes infinite = broadcast(kInfinity);
  return bitsOf((broadcast(0) - infinite < limit) & (limit < infinite)) == 0;
}

// Calls add(splat of the tile, mask of the pixels that show it, weights without its peak, orders) for each
// splat of a block. Not ordered: pixels show whatever reaches them, and orders are 0.
template <bool ordered, class Add>
inline void eachWeight(const TileSplats& tile, int block, Lanes limit, Add add) {
  const Centers at = centersOf(block);
  const Lanes zero = broadcast(0);
  eachSplat(tile, block, [&](uint32_t splat) {
    const TileSplat& s = tile.splats[splat];
    const Lanes inside = insideOf(s, at), weight = colorWeight(inside);
    if constexpr (ordered) {
      const Lanes order = orderOf(s, at);
      add(splat, (zero <= inside) & (order < limit), weight, order);
    } else {
      add(splat, zero <= inside, weight, zero);
    }
  });
}

// blendBlock of SplatKernels. Not ordered: limits are all or nothing.
template <int triples, bool ordered, bool finite>
inline void blendBlockAs(const TileSplats& tile, int block, const float* limits, const float* alpha,
                         const float* values, float* out) {
  const Lanes zero = broadcast(0), limit = load(limits);
  Lanes sum = zero, sums[3 * triples];
  for (Lanes& s : sums) s = zero;
  eachWeight<ordered>(tile, block, limit, [&](uint32_t splat, Mask in, Lanes weight, Lanes) {
    const float* value = values + 4 * triples * static_cast<size_t>(splat);
    const Lanes seen = where(in, weight);
    sum = mulAdd(seen, broadcast(value[3]), sum);
    for (int k = 0; k < 3 * triples; ++k) {
      const Lanes next = mulAdd(seen, broadcast(value[k / 3 * 4 + k % 3]), sums[k]);
      // Pixels that do not show an infinite value keep their sum: 0 times the value is no number.
      sums[k] = finite ? next : select(in, next, sums[k]);
    }
  });
  const Mask any = (zero < sum) & (zero - broadcast(kInfinity) < limit);
  const Lanes scale = load(alpha) / select(any, sum, broadcast(1));
  for (int k = 0; k < 3 * triples; ++k) store(out + k * kLanes, where(any, sums[k] * scale));
}

template <int triples>
inline void blendTriples(const TileSplats& tile, int block, const float* limits, const float* alpha,
                         const float* values, bool finite, float* out) {
  if (!finite) {
    blendBlockAs<triples, true, false>(tile, block, limits, alpha, values, out);
  } else if (showAllOrNothing(load(limits))) {
    blendBlockAs<triples, false, true>(tile, block, limits, alpha, values, out);
  } else {
    blendBlockAs<triples, true, true>(tile, block, limits, alpha, values, out);
  }
}

inline void blendBlockLoop(const TileSplats& tile, int block, const float* limits, const float* alpha,
                           const float* values, int triples, bool finite, float* out) {
  (triples == 2 ? blendTriples<2> : blendTriples<1>)(tile, block, limits, alpha, values, finite, out);
}

inline void meanOrderLoop(const TileSplats& tile, int block, const float* limits, float* out) {
  const Lanes zero = broadcast(0);
  Lanes sum = zero, sumOfOrders = zero;
  eachWeight<true>(tile, block, load(limits), [&](uint32_t splat, Mask in, Lanes weight, Lanes order) {
    const Lanes seen = where(in, weight * broadcast(tile.splats[splat].shape.peak));
    sum = sum + seen;
    sumOfOrders = mulAdd(seen, order, sumOfOrders);
  });
  store(out, sumOfOrders / select(zero < sum, sum, broadcast(1)));
}

} // namespace
} // namespace surflect::splat
