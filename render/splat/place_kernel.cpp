#include "render/splat/splat_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/splat/place_kernel.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::splat {
namespace HWY_NAMESPACE {
namespace {

static_assert(kBlocks == 64 && kBlocksPerRow == 8 && kGroup == 64);

// Expresses a splat relative to the middle of the tile with corner pixel (x, y). Written field by field:
// copying an assembled struct would wait for its parts to be stored.
HWY_INLINE void placeAboutMiddle(const ScreenSplat& from, int x, int y, TileSplat& to) {
  const float cx = from.x - static_cast<float>(x + kTileSize / 2),
              cy = from.y - static_cast<float>(y + kTileSize / 2);
  const SplatShape& s = from.shape;
  to.shape = s;
  to.a0 = -(s.ax * cx + s.ay * cy);
  to.b0 = -s.by * cy;
  to.order0 = from.order - s.orderX * cx - s.orderY * cy;
}

// Sets of a tile's blocks, one bit each: blocks right of a column's left edge, and blocks below a row's upper
// edge.
struct EdgeSets {
  uint64_t right[kBlocksPerRow + 1] = {}, below[kBlocksPerRow + 1] = {};
  constexpr EdgeSets() {
    for (int edge = 0; edge <= kBlocksPerRow; ++edge)
      for (int block = 0; block < kBlocks; ++block) {
        right[edge] |= uint64_t{block % kBlocksPerRow >= edge} << block;
        below[edge] |= uint64_t{block / kBlocksPerRow >= edge} << block;
      }
  }
};
constexpr EdgeSets edgeSets;

// Blocks under a box that touches the tile.
HWY_INLINE uint64_t blocksUnder(const PixelBox& box, int x, int y) {
  const auto first = [](int pixel) HWY_ATTR { return (pixel < 0 ? 0 : pixel) / kBlockSize; };
  const auto last = [](int pixel) HWY_ATTR {
    return ((pixel < kTileSize ? pixel : kTileSize) + kBlockSize - 1) / kBlockSize;
  };
  const auto from = [](int edge) HWY_ATTR { return static_cast<unsigned>(edge); };
  return (edgeSets.right[from(first(box.x0 - x))] ^ edgeSets.right[from(last(box.x1 - x))]) &
         (edgeSets.below[from(first(box.y0 - y))] ^ edgeSets.below[from(last(box.y1 - y))]);
}

// Transposes each group of 64 x 64 bits, by swapping halves, quarters and so on [Warren 2013, Hacker's
// Delight, 7-3].
HWY_INLINE void turnSets(uint64_t* sets, uint32_t groups) {
  static_assert(kBlocks == kGroup && kGroup == 64);
  for (uint64_t* group = sets; group != sets + size_t{kBlocks} * groups; group += kBlocks) {
    uint64_t low = 0xffffffff; // the lower half of every 2 * half bits
    for (int half = 32; half != 0; half /= 2, low ^= low << half)
      for (int first = 0; first < kGroup; first += 2 * half)
        for (int i = first; i < first + half; ++i) {
          const uint64_t swapped = (group[i] >> half ^ group[i + half]) & low;
          group[i] ^= swapped << half;
          group[i + half] ^= swapped;
        }
  }
}

PlacedSplats placeSplats(const ScreenSplat* screen, const uint32_t* entries, uint32_t count, int x, int y,
                         TileSplat* splats, uint64_t* sets, uint32_t* column) {
  constexpr uint32_t kAhead = 24;
  for (uint32_t i = 0; i < count; ++i) {
    __builtin_prefetch(&screen[entries[i + kAhead < count ? i + kAhead : count - 1]]);
    const ScreenSplat& from = screen[entries[i]];
    placeAboutMiddle(from, x, y, splats[i]);
    sets[i] = blocksUnder(from.box, x, y);
    column[i] = from.splat;
  }
  const uint32_t groups = groupsOf(count);
  for (uint32_t i = count; i < groups * kGroup; ++i) sets[i] = 0;
  turnSets(sets, groups);
  PlacedSplats placed{0, 0};
  for (int block = 0; block < kBlocks; ++block) {
    uint32_t ofBlock = 0;
    for (uint32_t g = 0; g < groups; ++g)
      ofBlock += static_cast<uint32_t>(__builtin_popcountll(sets[g * kBlocks + block]));
    placed.most = placed.most < ofBlock ? ofBlock : placed.most;
    placed.blocks |= uint64_t{ofBlock != 0} << block;
  }
  return placed;
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::splat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::splat {

HWY_EXPORT(placeSplats);
PlacedSplats placeSplats(const ScreenSplat* screen, const uint32_t* entries, uint32_t count, int x, int y,
                         TileSplat* splats, uint64_t* sets, uint32_t* column) {
  return HWY_DYNAMIC_DISPATCH(placeSplats)(screen, entries, count, x, y, splats, sets, column);
}
} // namespace surflect::splat
#endif
