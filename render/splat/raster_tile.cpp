#include "render/splat/raster_tile.h"

#include "render/splat/footprint.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace surflect::splat {

float saturated(float area) {
  return std::clamp((area - (1 - kOpaqueArea)) / (2 * kOpaqueArea - 1), 0.f, 1.f);
}

void layersOf(const std::vector<Fragment>& fragments, bool keepsHidden, std::vector<Layer>& layers) {
  layers.clear();
  float area = 0, alpha = 0;
  for (size_t begin = 0, end; begin < fragments.size() && (keepsHidden || alpha < 1); begin = end) {
    float layerArea = 0, back = -std::numeric_limits<float>::infinity();
    for (end = begin; end < fragments.size(); ++end) {
      const Fragment& f = fragments[end];
      if (end > begin && f.order - f.tolerance > back) break;
      if (layerArea < kLayerAnchorArea) back = std::max(back, f.order + f.tolerance);
      layerArea += f.area;
    }
    area += layerArea;
    const float alphaBefore = std::exchange(alpha, saturated(area));
    layers.push_back({begin, end, layerArea, alpha - alphaBefore});
  }
}

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Middle of pixel i of a row or column, relative to the tile's middle.
float fromMiddle(uint32_t i) { return static_cast<float>(i) - kTileSize / 2 + 0.5f; }

// q of a splat at a position relative to the tile's middle (TileSplat).
float squaredDistance(const TileSplat& s, float x, float y) {
  const float a = s.a0 + s.shape.ax * x + s.shape.ay * y, b = s.b0 + s.shape.by * y;
  return a * a + b * b;
}

// Colour weight of a splat at a position relative to the tile's middle, without its peak.
float weightAt(const TileSplat& s, float x, float y) {
  constexpr auto exponent = static_cast<float>(-kCutoffSigmas * kCutoffSigmas);
  return std::exp(exponent * squaredDistance(s, x, y));
}

BlockFragments blockFragments(size_t count, TileScratch& scratch) {
  const size_t room = count + kLanes;
  return {scratch.orders.of(kLanes * room), scratch.areas.of(kLanes * room), scratch.tolerances.of(room),
          scratch.splats.of(room)};
}
PixelFragments pixelFragments(size_t count, TileScratch& scratch) {
  const size_t room = count + 2 * kLanes;
  return {scratch.order.of(room), scratch.tolerance.of(room), scratch.area.of(room), scratch.splat.of(room),
          scratch.rank.of(room)};
}

// Pixels with more fragments than this are sorted by comparison, since the cost of sorting by rank is
// quadratic.
constexpr size_t kManyFragments = 2048;

// Sorts the fragments of a pixel by depth, nearest first; fragments of equal depth keep the order of the
// tile.
void sortPixel(uint32_t count, const PixelFragments& pixel, std::vector<Fragment>& sorted) {
  constexpr uint32_t none = std::numeric_limits<uint32_t>::max();
  const bool ranked = count <= kManyFragments;
  if (ranked) rankPixel(count, pixel);
  sorted.assign(count, {0, 0, 0, none});
  for (uint32_t i = 0; i < count; ++i) {
    uint32_t place = ranked ? static_cast<uint32_t>(pixel.rank[i]) : i;
    while (sorted[place].splat != none) ++place; // skips places taken by fragments of equal depth
    sorted[place] = {pixel.order[i], pixel.tolerance[i], pixel.area[i],
                     std::bit_cast<uint32_t>(pixel.splat[i])};
  }
  if (!ranked) std::ranges::stable_sort(sorted, {}, &Fragment::order);
}

// Resolves the layers of a pixel that the kernel left unresolved. A single layer is written to `layers`,
// several to the tile.
void resolvePixel(int block, int lane, bool keepsHidden, TileScratch& scratch, RasterTile& tile,
                  BlockLayers& layers) {
  const std::vector<Fragment>& fragments = scratch.fragments;
  layersOf(fragments, keepsHidden, scratch.layers);

  const auto isKept = [&](const Layer& layer) { return layer.alpha > 0 || (keepsHidden && layer.area > 0); };
  float area = 0;
  size_t visibleLayers = 0;
  for (const Layer& layer : scratch.layers) {
    area += layer.area;
    visibleLayers += isKept(layer);
  }
  const Layer& first = scratch.layers.front();
  layers.alpha[lane] = saturated(area);
  layers.area[lane] = first.area;
  layers.limit[lane] = first.end < fragments.size() ? fragments[first.end].order : kInfinity;
  if (visibleLayers == 1 && first.alpha > 0) return;

  layers.limit[lane] = -kInfinity;
  const auto x = static_cast<uint32_t>(block % kBlocksPerRow * kBlockSize + lane % kBlockSize),
             y = static_cast<uint32_t>(block / kBlocksPerRow * kBlockSize + lane / kBlockSize);
  float alpha = 0;
  bool halfway = false;
  for (const Layer& layer : scratch.layers) {
    if (!isKept(layer)) continue;
    alpha += layer.alpha;
    const bool isMedian = !halfway && alpha >= layers.alpha[lane] / 2;
    halfway |= isMedian;
    if (isMedian) layers.area[lane] = layer.area;
    const auto begin = static_cast<uint32_t>(tile.contributions.size());
    float weight = 0, weightedOrder = 0;
    for (size_t i = layer.begin; i < layer.end; ++i) {
      const Fragment& f = fragments[i];
      const TileSplat& splat = tile.drawn.splats[f.splat];
      const float w = weightAt(splat, fromMiddle(x), fromMiddle(y));
      tile.contributions.push_back({f.splat, w});
      weight += splat.shape.peak * w;
      weightedOrder += splat.shape.peak * w * f.order;
      scratch.seen.data()[f.splat / kGroup] |= uint64_t{1} << f.splat % kGroup;
    }
    tile.layers.push_back({y * kTileSize + x, begin, static_cast<uint32_t>(layer.end - layer.begin),
                           layer.alpha, layer.area, weightedOrder / weight, isMedian});
  }
}

// Places the splats in the tile.
PlacedSplats gatherSplats(const ScreenSplat* screen, std::span<const uint32_t> entries,
                          const TileFrame& frame, RasterTile& tile) {
  if (entries.size() > std::numeric_limits<uint32_t>::max() / kLanes)
    throw Error::mismatch("at most 2^28 splats in a tile", std::to_string(entries.size()));
  const auto count = static_cast<uint32_t>(entries.size()), groups = groupsOf(count);
  TileSplat* splats = tile.splats.of(count);
  uint32_t* column = tile.column.of(count);
  uint64_t* sets = tile.sets.of(size_t{kGroup} * groups);
  tile.drawn = {splats, sets, count};
  return placeSplats(screen, entries.data(), count, frame.x0, frame.y0, splats, sets, column);
}

// Marks the splats that are visible in a block's set or in a pixel of several layers.
void markSeen(const RasterTile& tile, uint64_t* seenOfTile, std::span<uint8_t> seenOfCloud) {
  const TileSplats& drawn = tile.drawn;
  for (uint32_t group = 0; group < groupsOf(drawn.count); ++group) {
    uint64_t seen = seenOfTile[group];
    for (int block = 0; block < kBlocks; ++block)
      seen |= drawn.sets[group * kBlocks + static_cast<uint32_t>(block)];
    for (; seen != 0; seen &= seen - 1) {
      const uint32_t splat = group * kGroup + static_cast<uint32_t>(std::countr_zero(seen));
      const std::atomic_ref mark(seenOfCloud[tile.column.data()[splat]]);
      if (!mark.load(std::memory_order_relaxed)) mark.store(1, std::memory_order_relaxed);
    }
  }
}

void clearBlock(const TileFrame& frame, int block, const PixelSums& pixels) {
  forRows(frame, block, [&](size_t, int x, int y, size_t count) {
    const size_t pixel = static_cast<size_t>(y) * pixels.width + static_cast<size_t>(x);
    std::fill_n(pixels.alpha + pixel, count, 0.f);
    std::fill_n(pixels.layerArea + pixel, count, 0.f);
  });
}

} // namespace

void rasterizeTile(const ScreenSplat* screen, std::span<const uint32_t> entries, const TileFrame& frame,
                   bool searchLayers, bool keepsHidden, TileScratch& scratch, RasterTile& tile,
                   const PixelSums& pixels, std::span<uint8_t> seenOfCloud) {
  tile.layers.clear();
  tile.contributions.clear();
  const uint64_t filledBefore = std::exchange(tile.blocks, 0);
  if (entries.empty() && filledBefore == 0) {
    tile.drawn.count = 0;
    return;
  }
  const PlacedSplats placed = gatherSplats(screen, entries, frame, tile);
  const BlockFragments fragments = blockFragments(placed.most, scratch);
  const PixelFragments ofPixel = pixelFragments(placed.most, scratch);
  uint64_t* seen = scratch.seen.of(groupsOf(tile.drawn.count));
  std::fill_n(seen, groupsOf(tile.drawn.count), 0);
  float* allLimits = tile.limits.of(entries.empty() ? 0 : size_t{kBlocks} * kLanes);

  for (int block = 0; block < kBlocks; ++block) {
    if ((placed.blocks >> block & 1) == 0) {
      if (filledBefore >> block & 1) clearBlock(frame, block, pixels);
      continue;
    }
    BlockLayers layers;
    resolveBlock(tile.drawn, block, frame.width, frame.height, searchLayers, keepsHidden, fragments, layers);
    for (uint32_t bits = layers.unresolved; bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      const uint32_t n = gatherPixel(layers.count, lane, fragments, ofPixel);
      sortPixel(n, ofPixel, scratch.fragments);
      resolvePixel(block, lane, keepsHidden, scratch, tile, layers);
    }
    if (layers.mayHide) removeHiddenSplats(tile.drawn, block, fragments, layers.limit);
    if (layers.count != 0) {
      tile.blocks |= uint64_t{1} << block;
      std::copy_n(layers.limit, kLanes, allLimits + static_cast<size_t>(block) * kLanes);
    }
    forRows(frame, block, [&](size_t lane, int x, int y, size_t pixelsInRow) {
      const size_t pixel = static_cast<size_t>(y) * pixels.width + static_cast<size_t>(x);
      copyRow(layers.alpha + lane, pixelsInRow, pixels.alpha + pixel);
      copyRow(layers.area + lane, pixelsInRow, pixels.layerArea + pixel);
    });
  }
  markSeen(tile, seen, seenOfCloud);
}

std::optional<uint32_t> heaviestSplat(const RasterTile& tile, int x, int y) {
  const int block = y / kBlockSize * kBlocksPerRow + x / kBlockSize;
  if ((tile.blocks >> block & 1) == 0) return std::nullopt;
  float heaviest = 0;
  std::optional<uint32_t> splat;
  const auto consider = [&](uint32_t i, float weight) {
    if (!(weight > heaviest)) return;
    heaviest = weight;
    splat = tile.column.data()[i];
  };
  for (const PixelLayer& layer : tile.layers) { // of a pixel that shows several, whose limit is -infinity
    if (layer.pixel != static_cast<uint32_t>(y * kTileSize + x)) continue;
    const auto contributions = std::span(tile.contributions).subspan(layer.begin, layer.count);
    const auto weightOf = [&](const Contribution& c) {
      return c.weight * tile.drawn.splats[c.splat].shape.peak;
    };
    float sum = 0;
    for (const Contribution& c : contributions) sum += weightOf(c);
    for (const Contribution& c : contributions) consider(c.splat, layer.alpha * weightOf(c) / sum);
  }
  const float limit = tile.limits.data()[block * kLanes + y % kBlockSize * kBlockSize + x % kBlockSize];
  const float atX = fromMiddle(static_cast<uint32_t>(x)), atY = fromMiddle(static_cast<uint32_t>(y));
  for (uint32_t i = 0; i < tile.drawn.count; ++i) {
    const TileSplat& s = tile.drawn.splats[i];
    const float order = s.order0 + s.shape.orderX * atX + s.shape.orderY * atY;
    if (order < limit && squaredDistance(s, atX, atY) <= 1) consider(i, s.shape.peak * weightAt(s, atX, atY));
  }
  return splat;
}

} // namespace surflect::splat
