// The layers of a block's pixels.
#pragma once

#include "render/splat_lanes.h"

namespace surflect {
namespace {

inline void listBlocksLoop(TileLists& tile) {
  // Counts at the corners of boxes; sums over all before them, in x and y, are the counts of blocks.
  constexpr int stride = kBlocksPerRow + 1;
  int32_t counts[stride * stride] = {};
  for (uint32_t i = 0; i < tile.count; ++i) {
    const TileSplat& s = tile.splats[i];
    ++counts[s.blockY0 * stride + s.blockX0];
    --counts[s.blockY0 * stride + s.blockX1];
    --counts[s.blockY1 * stride + s.blockX0];
    ++counts[s.blockY1 * stride + s.blockX1];
  }
  uint32_t begin = 0, ends[kBlocks + 1];
  for (int y = 0; y < kBlocksPerRow; ++y) {
    int32_t rowSum = 0; // down to this row, left of and at the block
    for (int x = 0; x < kBlocksPerRow; ++x) {
      if (y > 0) counts[y * stride + x] += counts[(y - 1) * stride + x];
      rowSum += counts[y * stride + x];
      tile.begin[y * kBlocksPerRow + x] = ends[y * kBlocksPerRow + x] = begin;
      begin += static_cast<uint32_t>(rowSum);
    }
  }
  // Four blocks are written without asking whether there are as many: where there are not, beyond the list.
  ends[kBlocks] = begin;
  uint32_t* list = tile.list;
  const uint32_t count = tile.count;
  for (uint32_t i = 0; i < count; ++i) {
    const TileSplat& s = tile.splats[i];
    const int x0 = s.blockX0, y0 = s.blockY0, x1 = s.blockX1, y1 = s.blockY1;
    const auto put = [&](int block, bool there) {
      const int to = there ? block : kBlocks;
      const uint32_t at = ends[to];
      list[at] = i;
      ends[to] = at + (there ? 1 : 0);
    };
    const bool some = x0 < x1 && y0 < y1;
    const bool wide = x1 > x0 + 1;
    const bool high = y1 > y0 + 1;
    const int corner = y0 * kBlocksPerRow + x0;
    put(corner, some);
    put(corner + 1, some & wide);
    put(corner + kBlocksPerRow, some & high);
    put(corner + kBlocksPerRow + 1, wide & high);
    if (x1 - x0 <= 2 && y1 - y0 <= 2) continue;
    for (int y = y0; y < y1; ++y)
      for (int x = y < y0 + 2 ? x0 + 2 : x0; x < x1; ++x) list[ends[y * kBlocksPerRow + x]++] = i;
  }
  __builtin_memcpy(tile.end, ends, sizeof tile.end);
}

// How often a block's pixels are asked where their first layer is rooted.
constexpr int kRounds = 4;
// The first layer of each pixel of a block, without sorting; layersOf in pixel_layers.h says what a layer is.
//
// Where the depth intervals of all fragments have a point in common there is one layer. Elsewhere, `back` is
// a bound from below of how far the layer's intervals reach, first the nearest end of any. If it reached no
// further, the layer would end before the first fragment that lies beyond; if it ends there too when all
// before that extend it, then it does end there. Where it does not, planes are tried between the first and
// the last of them, for the one where the area comes to kRooted: of fragments before a plane, those with an
// area of less all extend the layer, and so does the next; those with more extend it as far as it goes at
// all. Then the question is asked again. If the layer also fills the pixel, nothing behind matters. The
// caller looks at what remains, in pictures rich in outlines a pixel in twenty-five.
inline void resolveBlockLoop(TileLists& tile, int block, int width, int height,
                             const BlockFragments& fragments, BlockLayers& out) {
  float *orders = fragments.orders, *areas = fragments.areas, *tolerances = fragments.tolerances;
  const Centers at = centersOf(block);
  const uint32_t begin = tile.begin[block], endOfList = tile.end[block];
  uint32_t* list = tile.list;
  const Lanes infinite = broadcast(kInfinity), zero = broadcast(0), none = broadcast(kNotANumber);

  Lanes total = zero, nearestEnd = infinite, farthestFront = zero - infinite;
  uint32_t count = 0;
  for (uint32_t i = begin; i < endOfList; ++i) {
    const uint32_t splat = list[i];
    const TileSplat& s = tile.splats[splat];
    const Lanes inside = insideOf(s, at), tolerance = broadcast(s.tolerance);
    const Mask in = zero <= inside;
    const Lanes t = max(inside, zero);
    const Lanes area = t * t * broadcast(s.peak * kAreaPeak);
    total = total + area;
    const Lanes order = select(in, orderOf(s, at), none);
    nearestEnd = min(order + tolerance, nearestEnd);
    farthestFront = max(order - tolerance, farthestFront);
    store(orders + kLanes * count, order);
    store(areas + kLanes * count, area);
    const uint32_t reached = bitsOf(in);
    fragments.reached[count] = reached;
    tolerances[count] = s.tolerance;
    list[begin + count] = splat;
    count += reached != 0 ? 1 : 0;
  }
  tile.end[block] = begin + count;

  const Mask inTile = (at.x < broadcast(static_cast<float>(width - kTileSize / 2))) &
                      (at.y < broadcast(static_cast<float>(height - kTileSize / 2)));
  const Mask covered = inTile & (zero < saturatedLanes(total));
  Lanes layerArea = total, limit = infinite;
  Mask open = andNot(covered, farthestFront <= nearestEnd);
  out.unresolved = 0;
  if (bitsOf(open) != 0) {
    const auto each = [&](auto visit) {
      for (uint32_t i = 0; i < count; ++i)
        visit(load(orders + kLanes * i), load(areas + kLanes * i), broadcast(tolerances[i]));
    };
    const auto breakBehind = [&](Lanes back) {
      Lanes first = infinite;
      each([&](Lanes order, Lanes, Lanes tolerance) {
        first = minWhere(back < order - tolerance, first, order);
      });
      return first;
    };
    Lanes back = nearestEnd, atMost = infinite;
    Lanes end = infinite, area = zero, low = zero, high = zero;
    Mask trying = open;
    // Where the layer ends if it reaches to `back` at least and `atMost` at most.
    const auto settle = [&] {
      const Lanes first = breakBehind(back);
      Lanes before = zero, reach = back, nearest = infinite, farthest = zero - infinite;
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
    };
    settle();
    if (bitsOf(trying) != 0) {
      Lanes areaLow = zero, areaHigh = area;
      for (int round = 0; round < kRounds; ++round) {
        const Lanes share =
            round % 2 == 0 ? (broadcast(kRooted) - areaLow) / (areaHigh - areaLow) : broadcast(0.5f);
        const Lanes plane = mulAdd(high - low, share, low);
        Lanes before = zero, reach = back, next = infinite, nextEnd = infinite;
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
      settle();
    }
    const Mask unended = andNot(open, trying) & (infinite <= end); // one layer after all
    const Mask full = andNot(open, trying) & (broadcast(kFull) <= area);
    const Mask ended = andNot(full, unended);
    limit = select(ended, end, limit);
    layerArea = select(ended, area, layerArea);
    out.unresolved = bitsOf(andNot(andNot(open, unended), full));
  }
  store(out.alpha, select(covered, saturatedLanes(layerArea), zero));
  store(out.area, layerArea);
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
    n += static_cast<uint32_t>(ones(in));
  }
  for (uint32_t i = n; i < roundedUp(n); ++i) {
    to.order[i] = kInfinity;
    to.area[i] = to.tolerance[i] = 0;
  }
  return n;
}

inline void rankPixelLoop(uint32_t n, const PixelFragments& pixel) {
  const Lanes one = broadcast(1);
  for (uint32_t i = 0; i < n; i += kLanes) {
    const Lanes here = load(pixel.order + i);
    Lanes rank = broadcast(0);
    for (uint32_t j = 0; j < n; ++j) rank = addWhere(broadcast(pixel.order[j]) < here, rank, one);
    store(pixel.work + i, rank);
  }
}

// layersOf in pixel_layers.h for the first layer, each fragment compared with each.
inline bool firstLayerLoop(uint32_t n, const PixelFragments& pixel, int lane, BlockLayers& out) {
  const Lanes infinite = broadcast(kInfinity), zero = broadcast(0);
  const float *order = pixel.order, *tolerance = pixel.tolerance, *area = pixel.area;
  float* ends = pixel.work;
  const uint32_t padded = roundedUp(n);
  for (uint32_t i = 0; i < padded; i += kLanes) {
    const Lanes here = load(order + i);
    Lanes before = zero;
    for (uint32_t j = 0; j < n; ++j)
      before = addWhere(broadcast(order[j]) < here, before, broadcast(area[j]));
    store(ends + i, select(before < broadcast(kRooted), here + load(tolerance + i), zero - infinite));
  }
  Lanes nearest = infinite;
  for (uint32_t i = 0; i < padded; i += kLanes) {
    const Lanes here = load(order + i);
    Lanes back = zero - infinite;
    for (uint32_t j = 0; j < n; ++j) back = maxWhere(broadcast(order[j]) < here, back, broadcast(ends[j]));
    const Mask breaks = (zero - infinite < back) & (back < here - load(tolerance + i));
    nearest = minWhere(breaks, nearest, here);
  }
  float limits[kLanes], sums[kLanes];
  store(limits, nearest);
  float limit = kInfinity;
  for (const float each : limits) limit = each < limit ? each : limit;
  Lanes sum = zero;
  for (uint32_t i = 0; i < padded; i += kLanes)
    sum = addWhere(load(order + i) < broadcast(limit), sum, load(area + i));
  store(sums, sum);
  float total = 0;
  for (const float each : sums) total += each;
  if (!(total >= kFull || limit == kInfinity)) return false;
  float alpha[kLanes];
  store(alpha, saturatedLanes(broadcast(total)));
  out.alpha[lane] = alpha[0];
  out.area[lane] = total;
  out.limit[lane] = limit;
  return true;
}

inline void keepSeenLoop(TileLists& tile, int block, const BlockFragments& fragments, const float* limits,
                         uint8_t* seen) {
  const Lanes limit = load(limits), infinite = broadcast(kInfinity), zero = broadcast(0);
  const uint32_t whole = bitsOf(infinite <= limit);                              // pixels that show all
  const bool some = bitsOf((zero - infinite < limit) & (limit < infinite)) != 0; // or what is nearer
  const uint32_t begin = tile.begin[block], count = tile.end[block] - begin;
  uint32_t* list = tile.list + begin; // what is read through pointers would be read anew after each byte
  const uint32_t* reached = fragments.reached;
  const float* orders = fragments.orders;
  uint32_t kept = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t splat = list[i];
    bool reaches = (reached[i] & whole) != 0;
    if (some) reaches |= bitsOf(load(orders + kLanes * i) < limit) != 0;
    seen[splat] = static_cast<uint8_t>(seen[splat] | (reaches ? 1 : 0));
    list[kept] = splat;
    kept += reaches ? 1 : 0;
  }
  tile.end[block] = begin + kept;
}

} // namespace
} // namespace surflect
