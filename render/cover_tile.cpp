#include "render/cover_tile.h"

#include "surfel/error.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

namespace surflect {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

float weightAt(const TileSplat& s, float x, float y) {
  constexpr auto exponent = static_cast<float>(-kCutoffSigmas * kCutoffSigmas);
  const float a = s.a0 + s.ax * x + s.ay * y, b = s.b0 + s.by * y;
  return s.peak * std::exp(exponent * (a * a + b * b));
}

// About the middle of the tile whose corner is the pixel (x, y) of the picture.
TileSplat aboutMiddle(const ScreenSplat& from, int x, int y) {
  const float cx = from.x - static_cast<float>(x + kTileSize / 2),
              cy = from.y - static_cast<float>(y + kTileSize / 2);
  const auto block = [](int pixel, int corner) {
    return static_cast<uint8_t>(std::clamp(pixel - corner, 0, kTileSize) / kBlockSize);
  };
  TileSplat s;
  s.a0 = -(from.ax * cx + from.ay * cy);
  s.ax = from.ax, s.ay = from.ay;
  s.b0 = -from.by * cy;
  s.by = from.by;
  s.peak = from.peak;
  s.order0 = from.order - from.orderX * cx - from.orderY * cy;
  s.orderX = from.orderX, s.orderY = from.orderY;
  s.tolerance = from.tolerance;
  s.blockX0 = block(from.box.x0, x), s.blockX1 = block(from.box.x1 + kBlockSize - 1, x);
  s.blockY0 = block(from.box.y0, y), s.blockY1 = block(from.box.y1 + kBlockSize - 1, y);
  return s;
}

BlockFragments blockFragments(size_t count, TileScratch& scratch) {
  const size_t room = count + kLanes;
  return {scratch.orders.of(kLanes * room), scratch.areas.of(kLanes * room), scratch.tolerances.of(room),
          scratch.reached.of(room)};
}
PixelFragments pixelFragments(size_t count, TileScratch& scratch) {
  const size_t room = count + 2 * kLanes;
  return {scratch.order.of(room), scratch.tolerance.of(room), scratch.area.of(room), scratch.work.of(room)};
}

// More fragments than this in a pixel are not compared each with each.
constexpr size_t kManyFragments = 2048;

// The fragments of a pixel, nearest first; those of one depth in the order of the block's list.
void sortPixel(const SplatKernels& kernels, const TileLists& lists, int block, int lane, uint32_t count,
               const BlockFragments& ofBlock, const PixelFragments& pixel, std::vector<Fragment>& sorted) {
  constexpr uint32_t none = std::numeric_limits<uint32_t>::max();
  sorted.assign(count, {0, 0, 0, none});
  const bool ranked = count <= kManyFragments;
  if (ranked) kernels.rankPixel(count, pixel);
  const uint32_t begin = lists.begin[block];
  for (uint32_t i = 0, entry = 0; i < count; ++entry) {
    if ((ofBlock.reached[entry] >> lane & 1) == 0) continue;
    auto place = ranked ? static_cast<uint32_t>(pixel.work[i]) : i;
    while (sorted[place].splat != none) ++place; // taken by one of the same depth
    sorted[place] = {pixel.order[i], pixel.tolerance[i], pixel.area[i], lists.list[begin + entry]};
    ++i;
  }
  if (!ranked) std::ranges::stable_sort(sorted, {}, &Fragment::order);
}

// The layers of a pixel that the kernel left open: a single one goes to `block`, more to the tile.
void resolvePixel(const TileLists& lists, int block, int lane, TileScratch& scratch, uint8_t* seen,
                  CoverageTile& tile, BlockLayers& layers) {
  const std::vector<Fragment>& fragments = scratch.fragments;
  layersOf(fragments, scratch.layers);

  float area = 0;
  size_t visibleLayers = 0;
  for (const Layer& layer : scratch.layers) {
    area += layer.area;
    visibleLayers += layer.alpha > 0;
  }
  const Layer& first = scratch.layers.front();
  layers.alpha[lane] = saturated(area);
  layers.area[lane] = first.area;
  layers.limit[lane] = first.end < fragments.size() ? fragments[first.end].order : kInfinity;
  if (visibleLayers == 1 && first.alpha > 0) return;

  layers.limit[lane] = -kInfinity;
  const auto x = static_cast<uint32_t>(block % kBlocksPerRow * kBlockSize + lane % kBlockSize),
             y = static_cast<uint32_t>(block / kBlocksPerRow * kBlockSize + lane / kBlockSize);
  const auto fromMiddle = [](uint32_t i) { return static_cast<float>(i) - kTileSize / 2 + 0.5f; };
  float alpha = 0;
  bool halfway = false;
  for (const Layer& layer : scratch.layers) {
    if (!(layer.alpha > 0)) continue;
    alpha += layer.alpha;
    const bool isMiddle = !halfway && alpha >= layers.alpha[lane] / 2;
    halfway |= isMiddle;
    if (isMiddle) layers.area[lane] = layer.area;
    const auto begin = static_cast<uint32_t>(tile.contributions.size());
    float weight = 0, weightedOrder = 0;
    for (size_t i = layer.begin; i < layer.end; ++i) {
      const Fragment& f = fragments[i];
      const float w = weightAt(lists.splats[f.splat], fromMiddle(x), fromMiddle(y));
      tile.contributions.push_back({f.splat, w});
      weight += w;
      weightedOrder += w * f.order;
      seen[f.splat] = 1;
    }
    tile.layers.push_back({y * kTileSize + x, begin, static_cast<uint32_t>(layer.end - layer.begin),
                           layer.alpha, weightedOrder / weight, isMiddle});
  }
}

} // namespace

void coverTile(const SplatKernels& kernels, const ScreenSplat* screen, std::span<const uint32_t> entries,
               const TileFrame& frame, TileScratch& scratch, CoverageTile& tile, const PixelSums& pixels,
               std::span<uint8_t> seenOfCloud) {
  tile.lists.count = 0;
  tile.layers.clear();
  tile.contributions.clear();
  const auto pixelAt = [&](int x, int y) {
    return static_cast<size_t>(y) * pixels.width + static_cast<size_t>(x);
  };
  for (int y = frame.y0; y < frame.y0 + frame.height; ++y)
    for (float* sums : {pixels.alpha, pixels.layerArea})
      std::fill_n(sums + pixelAt(frame.x0, y), frame.width, 0.f);
  if (entries.empty()) return;

  constexpr size_t kAhead = 24;
  TileSplat* splats = tile.splats.of(entries.size());
  uint32_t* column = tile.column.of(entries.size());
  size_t pairs = 0;
  for (size_t i = 0; i < entries.size(); ++i) {
    __builtin_prefetch(&screen[entries[std::min(i + kAhead, entries.size() - 1)]]);
    splats[i] = aboutMiddle(screen[entries[i]], frame.x0, frame.y0);
    column[i] = screen[entries[i]].splat;
    pairs += static_cast<size_t>(splats[i].blockX1 - splats[i].blockX0) *
             static_cast<size_t>(splats[i].blockY1 - splats[i].blockY0);
  }
  if (pairs > std::numeric_limits<uint32_t>::max() / kLanes)
    throw Error::mismatch("at most 2^28 splats over the blocks of a tile", std::to_string(pairs));
  TileLists& lists = tile.lists;
  lists.splats = splats;
  lists.count = static_cast<uint32_t>(entries.size());
  lists.list = tile.list.of(pairs + 1);
  kernels.listBlocks(lists);
  uint8_t* seen = scratch.seen.of(entries.size());
  std::memset(seen, 0, entries.size());
  float* allLimits = tile.limits.of(size_t{kBlocks} * kLanes);

  for (int block = 0; block < kBlocks; ++block) {
    if (lists.end[block] == lists.begin[block]) continue;
    float* limits = allLimits + static_cast<size_t>(block) * kLanes;
    const BlockFragments fragments = blockFragments(lists.end[block] - lists.begin[block], scratch);
    BlockLayers layers;
    kernels.resolveBlock(lists, block, frame.width, frame.height, fragments, layers);
    const uint32_t count = lists.end[block] - lists.begin[block];
    const PixelFragments ofPixel = pixelFragments(count, scratch);
    for (uint32_t bits = layers.unresolved; bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      const uint32_t n = kernels.gatherPixel(count, lane, fragments, ofPixel);
      if (n <= kManyFragments && kernels.firstLayer(n, ofPixel, lane, layers)) continue;
      sortPixel(kernels, lists, block, lane, n, fragments, ofPixel, scratch.fragments);
      resolvePixel(lists, block, lane, scratch, seen, tile, layers);
    }
    std::copy_n(layers.limit, kLanes, limits);
    kernels.keepSeen(lists, block, fragments, limits, seen);
    forRows(frame, block, [&](size_t lane, int x, int y, size_t pixelsInRow) {
      std::copy_n(layers.alpha + lane, pixelsInRow, pixels.alpha + pixelAt(x, y));
      std::copy_n(layers.area + lane, pixelsInRow, pixels.layerArea + pixelAt(x, y));
    });
  }
  for (size_t i = 0; i < entries.size(); ++i) {
    const std::atomic_ref mark(seenOfCloud[column[i]]);
    if (seen[i] && !mark.load(std::memory_order_relaxed)) mark.store(1, std::memory_order_relaxed);
  }
}

} // namespace surflect
