// The layers of a block's pixels.
#pragma once

#include "render/splat/splat_lanes.h"

namespace surflect::splat {
namespace {

// How often a block's pixels are asked where their first layer is rooted.
constexpr int kRounds = 4;
// As few pixels are sooner sorted one by one.
constexpr int kFewPixels = 4;

// What the fragments of a block come to, for each pixel.
struct FragmentSums {
  uint32_t count; // of splats that reach a pixel
  Lanes area, nearestEnd, farthestFront;
};

// Their depths and areas go to `fragments`, not a number and 0 where a splat does not reach a pixel; splats
// that reach none leave the block.
inline FragmentSums gatherFragments(const TileSplats& tile, int block, const Centers& at,
                                    const BlockFragments& fragments) {
  float *orders = fragments.orders, *areas = fragments.areas;
  float *tolerances = fragments.tolerances, *splats = fragments.splats;
  const Lanes zero = broadcast(0), none = broadcast(kNotANumber);
  uint32_t count = 0;
  Lanes total = zero, nearestEnd = broadcast(kInfinity), farthestFront = zero - nearestEnd;
  keepSplats(tile, block, [&](uint32_t splat) {
    const TileSplat& s = tile.splats[splat];
    const Lanes inside = insideOf(s, at), tolerance = broadcast(s.shape.tolerance);
    const Mask in = zero <= inside;
    const Lanes area = where(in, inside * inside * broadcast(s.shape.areaPeak));
    total = total + area;
    const Lanes order = select(in, orderOf(s, at), none);
    nearestEnd = min(order + tolerance, nearestEnd);
    farthestFront = max(order - tolerance, farthestFront);
    store(orders + kLanes * count, order);
    store(areas + kLanes * count, area);
    tolerances[count] = s.shape.tolerance;
    splats[count] = __builtin_bit_cast(float, splat);
    const bool reaches = bitsOf(in) != 0;
    count += reaches;
    return reaches;
  });
  return {count, total, nearestEnd, farthestFront};
}

// Where the first layer ends in pixels whose depth intervals have no point in common, and its area.
//
// `back` is a bound from below of how far the layer's intervals reach, first the nearest end of any. If it
// reached no further, the layer would end before the first fragment that lies beyond; if it ends there too
// when all before that extend it, then it does end there. Where it does not, planes are tried between the
// first and the last of them, for the one where the area comes to kRooted: of fragments before a plane, those
// with an area of less all extend the layer, and so does the next; those with more extend it as far as it
// goes at all. Then the question is asked again.
struct FirstLayer {
  const BlockFragments& fragments;
  uint32_t count;
  Mask trying; // pixels where it is not known yet
  Lanes back;
  Lanes atMost = broadcast(kInfinity);
  Lanes end = broadcast(kInfinity), area = broadcast(0);
  Lanes low = broadcast(0), high = broadcast(0); // first and last fragment before the end

  // visit(order, area, tolerance) of each splat.
  template <class Visit> void each(const Visit& visit) const {
    for (uint32_t i = 0; i < count; ++i)
      visit(load(fragments.orders + kLanes * i), load(fragments.areas + kLanes * i),
            broadcast(fragments.tolerances[i]));
  }

  // The first fragment that begins behind a depth.
  Lanes breakBehind(Lanes depth) const {
    Lanes first = broadcast(kInfinity);
    each([&](Lanes order, Lanes, Lanes tolerance) {
      first = minWhere(depth < order - tolerance, first, order);
    });
    return first;
  }

  // If the layer reaches to `back` at least and `atMost` at most.
  void settle() {
    const Lanes first = breakBehind(back), none = broadcast(kNotANumber);
    Lanes before = broadcast(0), reach = back, nearest = broadcast(kInfinity),
          farthest = broadcast(0) - nearest;
    each([&](Lanes order, Lanes areaOf, Lanes tolerance) {
      const Mask nearer = order < first;
      const Lanes there = select(nearer, order, none);
      before = addWhere(nearer, before, areaOf);
      reach = max(there + tolerance, reach);
      nearest = min(there, nearest);
      farthest = max(there, farthest);
    });
    const Mask known = trying & (breakBehind(min(reach, atMost)) <= first);
    end = select(trying, first, end);
    area = select(trying, before, area);
    trying = andNot(trying, known);
    low = nearest, high = farthest;
  }

  // Narrows `back` and `atMost`.
  void tryPlanes() {
    const Lanes infinite = broadcast(kInfinity);
    Lanes areaLow = broadcast(0), areaHigh = area;
    for (int round = 0; round < kRounds; ++round) {
      const Lanes share =
          round % 2 == 0 ? (broadcast(kRooted) - areaLow) / (areaHigh - areaLow) : broadcast(0.5f);
      const Lanes plane = mulAdd(high - low, share, low);
      Lanes before = broadcast(0), reach = back, next = infinite, nextEnd = infinite;
      each([&](Lanes order, Lanes areaOf, Lanes tolerance) {
        const Mask nearer = order <= plane;
        const Lanes orderEnd = order + tolerance;
        before = addWhere(nearer, before, areaOf);
        reach = maxWhere(nearer, reach, orderEnd);
        next = min(select(nearer, infinite, order), next);
        nextEnd = min(select(nearer, infinite, orderEnd), nextEnd);
      });
      const Mask unrooted = before < broadcast(kRooted), within = plane < end;
      const Lanes further = select((next < end) & within, max(reach, nextEnd), reach);
      back = select(unrooted & within, max(back, further), back);
      atMost = select(unrooted, atMost, min(atMost, reach));
      low = select(unrooted, plane, low);
      areaLow = select(unrooted, before, areaLow);
      high = select(unrooted, high, plane);
      areaHigh = select(unrooted, areaHigh, before);
    }
  }
};

// The first layer of each pixel of a block, without sorting; layersOf in pixel_layers.h says what a layer is.
// Where the depth intervals of all fragments have a point in common there is one, and where the first fills
// the pixel nothing behind matters. The caller sorts the fragments of what remains.
inline void resolveBlockLoop(const TileSplats& tile, int block, int width, int height,
                             const BlockFragments& fragments, BlockLayers& out) {
  const Centers at = centersOf(block);
  const Lanes infinite = broadcast(kInfinity), zero = broadcast(0);
  const FragmentSums sums = gatherFragments(tile, block, at, fragments);
  const Mask inTile = (at.x < broadcast(static_cast<float>(width - kTileSize / 2))) &
                      (at.y < broadcast(static_cast<float>(height - kTileSize / 2)));
  const Mask covered = inTile & (zero < saturatedLanes(sums.area));
  const Mask open = andNot(covered, sums.farthestFront <= sums.nearestEnd);
  const Mask dark = andNot(zero - infinite < sums.farthestFront, covered);
  out.count = sums.count;
  out.mayHide = bitsOf(open) != 0 || bitsOf(dark) != 0;
  out.unresolved = 0;
  Lanes area = sums.area, limit = infinite;
  if (bitsOf(open) != 0) {
    FirstLayer layer{fragments, sums.count, open, sums.nearestEnd};
    layer.settle();
    if (ones(layer.trying) > kFewPixels) {
      layer.tryPlanes();
      layer.settle();
    }
    const Mask known = andNot(open, layer.trying);
    const Mask unended = known & (infinite <= layer.end); // one layer after all
    const Mask full = known & (broadcast(kFull) <= layer.area);
    const Mask ended = andNot(full, unended);
    limit = select(ended, layer.end, limit);
    area = select(ended, layer.area, area);
    out.unresolved = bitsOf(andNot(andNot(open, unended), full));
  }
  store(out.alpha, select(covered, saturatedLanes(area), zero));
  store(out.area, area);
  store(out.limit, select(covered, limit, zero - infinite));
}

inline uint32_t gatherPixelLoop(uint32_t count, int lane, const BlockFragments& from,
                                const PixelFragments& to) {
  uint32_t n = 0;
  for (uint32_t i = 0; i < count; i += kLanes) {
    const Lanes orders = loadColumn(from.orders + kLanes * i + lane);
    const Mask in = firstLanes(static_cast<int>(count - i)) & (orders < broadcast(kInfinity));
    storeCompressed(to.order + n, in, orders);
    storeCompressed(to.area + n, in, loadColumn(from.areas + kLanes * i + lane));
    storeCompressed(to.tolerance + n, in, load(from.tolerances + i));
    storeCompressed(to.splat + n, in, load(from.splats + i));
    n += static_cast<uint32_t>(ones(in));
  }
  for (uint32_t i = n; i < roundedUp(n); ++i) to.order[i] = kInfinity;
  return n;
}

inline void rankPixelLoop(uint32_t n, const PixelFragments& pixel) {
  const Lanes one = broadcast(1);
  for (uint32_t i = 0; i < n; i += kLanes) {
    const Lanes here = load(pixel.order + i);
    Lanes rank = broadcast(0);
    for (uint32_t j = 0; j < n; ++j) rank = addWhere(broadcast(pixel.order[j]) < here, rank, one);
    store(pixel.rank + i, rank);
  }
}

inline void keepSeenLoop(const TileSplats& tile, int block, const BlockFragments& fragments,
                         const float* limits) {
  const Lanes limit = load(limits);
  const float* orders = fragments.orders;
  keepSplats(tile, block, [&](uint32_t) {
    const bool seen = bitsOf(load(orders) < limit) != 0;
    orders += kLanes;
    return seen;
  });
}

} // namespace
} // namespace surflect::splat
