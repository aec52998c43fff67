#include "render/splat/splat_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/splat/layer_kernel.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include "render/splat/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace surflect::splat {
namespace HWY_NAMESPACE {
namespace {

HWY_INLINE uint32_t roundedUp(uint32_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

// Number of planes tried in the search for a block's first layers.
constexpr int kRounds = 4;
// Up to this many pixels are sorted one by one, which is faster.
constexpr int kFewPixels = 4;

// Sums over the fragments of a block, for each pixel.
struct FragmentSums {
  uint32_t count; // number of splats that reach a pixel
  Pixels area, nearestEnd, farthestFront;
};

// Writes the orders and areas of a block's fragments to `fragments`: NaN and 0 where a splat does not reach a
// pixel. Removes splats that reach no pixel from the block.
HWY_INLINE FragmentSums gatherFragments(const TileSplats& tile, int block, const Centers& at,
                                        const BlockFragments& fragments) {
  float *orders = fragments.orders, *areas = fragments.areas;
  float *tolerances = fragments.tolerances, *splats = fragments.splats;
  const Pixels zero = broadcast(0), none = broadcast(kNotANumber);
  uint32_t count = 0;
  Pixels total = zero, nearestEnd = broadcast(kInfinity), farthestFront = zero - nearestEnd;
  keepSplats(tile, block, [&](uint32_t splat) HWY_ATTR {
    const TileSplat& s = tile.splats[splat];
    const Pixels inside = insideOf(s, at), tolerance = broadcast(s.shape.tolerance);
    const PixelMask in = zero <= inside;
    const Pixels area = where(in, inside * inside * broadcast(s.shape.areaPeak));
    total = total + area;
    const Pixels order = select(in, orderOf(s, at), none);
    nearestEnd = min(order + tolerance, nearestEnd);
    farthestFront = max(order - tolerance, farthestFront);
    store(orders + kLanes * count, order);
    store(areas + kLanes * count, area);
    tolerances[count] = s.shape.tolerance;
    splats[count] = __builtin_bit_cast(float, splat);
    const bool reaches = any(in);
    count += reaches;
    return reaches;
  });
  return {count, total, nearestEnd, farthestFront};
}

// Finds the end and the area of the first layer, in pixels whose depth intervals have no common point.
//
// `back` and `atMost` are bounds of the layer's reach; `back` is initially the nearest end of any interval.
// With the reach `back`, the layer would end before the first fragment that begins behind `back`. If it still
// ends there when all earlier fragments extend it, the end is found. Otherwise tryPlanes narrows the bounds:
// it searches for the plane in front of which the fragments have the area kLayerAnchorArea. If the area in
// front of a plane is smaller, all fragments there and the next one behind extend the layer, which raises
// `back`. If the area is larger, no fragment behind the plane extends the layer, which lowers `atMost`. Then
// the end is checked again.
struct FirstLayer {
  const BlockFragments& fragments;
  uint32_t count;
  PixelMask trying; // pixels without a known end
  Pixels back;
  Pixels atMost = broadcast(kInfinity);
  Pixels end = broadcast(kInfinity), area = broadcast(0);
  Pixels low = broadcast(0), high = broadcast(0); // first and last fragment before the end

  // Calls visit(order, area, tolerance) for each splat.
  template <class Visit> HWY_INLINE void each(const Visit& visit) const {
    for (uint32_t i = 0; i < count; ++i)
      visit(load(fragments.orders + kLanes * i), load(fragments.areas + kLanes * i),
            broadcast(fragments.tolerances[i]));
  }

  // Order of the first fragment that begins behind a depth.
  HWY_INLINE Pixels breakBehind(Pixels depth) const {
    Pixels first = broadcast(kInfinity);
    each([&](Pixels order, Pixels, Pixels tolerance)
             HWY_ATTR { first = select(depth < order - tolerance, min(first, order), first); });
    return first;
  }

  // Finds the end as SplatOptions::searchLayers says if it is false; pixels that remain in `trying` have
  // none.
  HWY_INLINE void grow() {
    PixelMask growing = trying;
    for (int growth = 0; growth < kLayerGrowths && any(growing); ++growth) {
      const Pixels first = breakBehind(back);
      Pixels before = broadcast(0), reach = back;
      each([&](Pixels order, Pixels areaOf, Pixels tolerance) HWY_ATTR {
        const PixelMask nearer = order < first;
        before = select(nearer, before + areaOf, before);
        reach = select(nearer, max(order + tolerance, reach), reach);
      });
      end = select(growing, first, end);
      area = select(growing, before, area);
      trying = andNot(andNot(trying, broadcast(kOpaqueArea) <= area), broadcast(kInfinity) <= end);
      growing = growing & trying & (back < reach);
      back = reach;
    }
  }

  // Computes the end for the reach `back`. Drops pixels from `trying` if all fragments before the end, with a
  // reach of at most `atMost`, give the same end.
  HWY_INLINE void resolveEnd() {
    const Pixels first = breakBehind(back), none = broadcast(kNotANumber);
    Pixels before = broadcast(0), reach = back, nearest = broadcast(kInfinity),
           farthest = broadcast(0) - nearest;
    each([&](Pixels order, Pixels areaOf, Pixels tolerance) HWY_ATTR {
      const PixelMask nearer = order < first;
      const Pixels there = select(nearer, order, none);
      before = select(nearer, before + areaOf, before);
      reach = max(there + tolerance, reach);
      nearest = min(there, nearest);
      farthest = max(there, farthest);
    });
    const PixelMask known = trying & (breakBehind(min(reach, atMost)) <= first);
    end = select(trying, first, end);
    area = select(trying, before, area);
    trying = andNot(trying, known);
    low = nearest, high = farthest;
  }

  // Narrows the bounds `back` and `atMost`.
  HWY_INLINE void tryPlanes() {
    const Pixels infinite = broadcast(kInfinity);
    Pixels areaLow = broadcast(0), areaHigh = area;
    for (int round = 0; round < kRounds; ++round) {
      const Pixels share =
          round % 2 == 0 ? (broadcast(kLayerAnchorArea) - areaLow) / (areaHigh - areaLow) : broadcast(0.5f);
      const Pixels plane = mulAdd(high - low, share, low);
      Pixels before = broadcast(0), reach = back, next = infinite, nextEnd = infinite;
      each([&](Pixels order, Pixels areaOf, Pixels tolerance) HWY_ATTR {
        const PixelMask nearer = order <= plane;
        const Pixels orderEnd = order + tolerance;
        before = select(nearer, before + areaOf, before);
        reach = select(nearer, max(reach, orderEnd), reach);
        next = min(select(nearer, infinite, order), next);
        nextEnd = min(select(nearer, infinite, orderEnd), nextEnd);
      });
      const PixelMask unrooted = before < broadcast(kLayerAnchorArea), within = plane < end;
      const Pixels further = select((next < end) & within, max(reach, nextEnd), reach);
      back = select(unrooted & within, max(back, further), back);
      atMost = select(unrooted, atMost, min(atMost, reach));
      low = select(unrooted, plane, low);
      areaLow = select(unrooted, before, areaLow);
      high = select(unrooted, high, plane);
      areaHigh = select(unrooted, areaHigh, before);
    }
  }
};

// Finds the first layer of each pixel of a block without sorting; layersOf in raster_tile.h defines layers.
// If the depth intervals of all fragments have a common point, there is one layer; if the first layer fills
// the pixel, nothing behind it matters. The caller sorts the fragments of the remaining pixels.
void resolveBlock(const TileSplats& tile, int block, int width, int height, bool searchLayers,
                  bool keepsHidden, const BlockFragments& fragments, BlockLayers& out) {
  const Centers at = centersOf(block);
  const Pixels infinite = broadcast(kInfinity), zero = broadcast(0);
  const FragmentSums sums = gatherFragments(tile, block, at, fragments);
  const PixelMask inTile = (at.x < broadcast(static_cast<float>(width - kTileSize / 2))) &
                           (at.y < broadcast(static_cast<float>(height - kTileSize / 2)));
  const PixelMask covered = inTile & (zero < saturated(sums.area));
  const PixelMask open = andNot(covered, sums.farthestFront <= sums.nearestEnd);
  const PixelMask dark = andNot(zero - infinite < sums.farthestFront, covered);
  out.count = sums.count;
  out.mayHide = any(open) || any(dark);
  out.unresolved = 0;
  Pixels area = sums.area, limit = infinite;
  if (any(open)) {
    FirstLayer layer{fragments, sums.count, open, sums.nearestEnd};
    if (searchLayers) {
      layer.resolveEnd();
      if (ones(layer.trying) > kFewPixels) {
        layer.tryPlanes();
        layer.resolveEnd();
      }
    } else {
      layer.grow();
    }
    const PixelMask known = andNot(open, layer.trying);
    const PixelMask unended = known & (infinite <= layer.end); // the pixel has a single layer
    // A pixel that keeps what lies behind a full layer is left to the caller.
    const PixelMask full = known & (broadcast(keepsHidden ? kInfinity : kOpaqueArea) <= layer.area);
    const PixelMask ended = andNot(full, unended);
    limit = select(ended, layer.end, limit);
    area = select(ended, layer.area, area);
    out.unresolved = bitsOf(andNot(andNot(open, unended), full));
  }
  store(out.alpha, select(covered, saturated(area), zero));
  store(out.area, area);
  store(out.limit, select(covered, limit, zero - infinite));
}

uint32_t gatherPixel(uint32_t count, int lane, const BlockFragments& from, const PixelFragments& to) {
  const hn::RebindToSigned<PixelTag> kInts;
  const auto rows = hn::Iota(kInts, 0) * hn::Set(kInts, kLanes);
  uint32_t n = 0;
  for (uint32_t i = 0; i < count; i += kVectorLanes) {
    const auto column = [&](const float* floats) HWY_ATTR {
      return hn::GatherIndex(kFloats, floats + size_t{kLanes} * i + lane, rows);
    };
    const auto orders = column(from.orders);
    const auto in = And(hn::FirstN(kFloats, count - i), orders < hn::Set(kFloats, kInfinity));
    const auto keep = [&](float* floats, hn::Vec<PixelTag> x) HWY_ATTR {
      hn::StoreU(hn::Compress(x, in), kFloats, floats + n); // masked stores are slow
    };
    keep(to.order, orders);
    keep(to.area, column(from.areas));
    keep(to.tolerance, hn::LoadU(kFloats, from.tolerances + i));
    keep(to.splat, hn::LoadU(kFloats, from.splats + i));
    n += static_cast<uint32_t>(hn::CountTrue(kFloats, in));
  }
  for (uint32_t i = n; i < roundedUp(n); ++i) to.order[i] = kInfinity;
  return n;
}

void rankPixel(uint32_t n, const PixelFragments& pixel) {
  const auto one = hn::Set(kFloats, 1);
  for (uint32_t i = 0; i < n; i += kVectorLanes) {
    const auto here = hn::LoadU(kFloats, pixel.order + i);
    auto rank = hn::Zero(kFloats);
    for (uint32_t j = 0; j < n; ++j)
      rank = IfThenElse(hn::Set(kFloats, pixel.order[j]) < here, rank + one, rank);
    hn::StoreU(rank, kFloats, pixel.rank + i);
  }
}

void removeHiddenSplats(const TileSplats& tile, int block, const BlockFragments& fragments,
                        const float* limits) {
  const Pixels limit = load(limits);
  const float* orders = fragments.orders;
  keepSplats(tile, block, [&](uint32_t) HWY_ATTR {
    const bool seen = any(load(orders) < limit);
    orders += kLanes;
    return seen;
  });
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::splat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::splat {

HWY_EXPORT(resolveBlock);
void resolveBlock(const TileSplats& tile, int block, int width, int height, bool searchLayers,
                  bool keepsHidden, const BlockFragments& fragments, BlockLayers& out) {
  HWY_DYNAMIC_DISPATCH(resolveBlock)(tile, block, width, height, searchLayers, keepsHidden, fragments, out);
}

HWY_EXPORT(gatherPixel);
uint32_t gatherPixel(uint32_t count, int lane, const BlockFragments& from, const PixelFragments& to) {
  return HWY_DYNAMIC_DISPATCH(gatherPixel)(count, lane, from, to);
}

HWY_EXPORT(rankPixel);
void rankPixel(uint32_t count, const PixelFragments& pixel) { HWY_DYNAMIC_DISPATCH(rankPixel)(count, pixel); }

HWY_EXPORT(removeHiddenSplats);
void removeHiddenSplats(const TileSplats& tile, int block, const BlockFragments& fragments,
                        const float* limits) {
  HWY_DYNAMIC_DISPATCH(removeHiddenSplats)(tile, block, fragments, limits);
}
} // namespace surflect::splat
#endif
