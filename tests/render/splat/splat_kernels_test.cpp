#include "render/splat/splat_kernels.h"

#include "tests/support/each_simd.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace surflect::splat {
namespace {

// A splat with 1 - q = t in every pixel.
TileSplat evenSplat(float t) {
  TileSplat splat{};
  splat.a0 = std::sqrt(1 - t);
  return splat;
}

// The blend of two splats that cover all pixels, one at its centre and one with 1 - q = t, gives the ratio of
// their weights.
TEST(SplatKernels, ColorWeightsAreGaussianUpToTheCutOff) {
  for (const Simd simd : EachSimd())
    for (int i = 0; i <= 2'000; ++i) {
      const float t = static_cast<float>(i) / 2'000;
      const std::vector<TileSplat> splats{evenSplat(1), evenSplat(t)};
      std::vector<uint64_t> sets(kBlocks, 3);
      const std::vector<float> limits(kLanes, INFINITY), alpha(kLanes, 1);
      const std::vector<float> values{1, 0, 0, 1, 0, 1, 0, 1}; // red and green
      float sums[3 * kLanes];
      blendBlock({splats.data(), sets.data(), 2}, 5, limits.data(), alpha.data(), values.data(), 1, true,
                 sums);
      const double a0 = splats[1].a0, expected = std::exp(-kCutoffSigmas * kCutoffSigmas * a0 * a0);
      for (int lane = 0; lane < kLanes; ++lane) {
        EXPECT_NEAR(double{sums[kLanes + lane]} / double{sums[lane]} / expected, 1, 8e-6)
            << nameOf(simd) << ' ' << t;
        EXPECT_EQ(sums[2 * kLanes + lane], 0);
      }
    }
}

TEST(SplatKernels, BlocksHaveTheSplatsWhoseBoxesTouchThem) {
  std::mt19937 random(1);
  const auto upTo = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most + 1)); };
  constexpr uint32_t count = 300;
  std::vector<ScreenSplat> screen(2 * count);
  std::vector<uint32_t> entries;
  for (uint32_t i = 0; i < count; ++i) {
    entries.push_back(2 * i + random() % 2);
    const int x0 = upTo(kTileSize + 4) - 5, y0 = upTo(kTileSize + 4) - 5;
    ScreenSplat& splat = screen[entries.back()];
    splat.box = {x0 + 64, y0 + 96, std::max(x0, 0) + 1 + upTo(20) + 64, std::max(y0, 0) + 1 + upTo(20) + 96};
    splat.splat = i;
  }
  std::vector<TileSplat> splats(count);
  std::vector<uint64_t> sets(size_t{groupsOf(count)} * kBlocks);
  std::vector<uint32_t> column(count);
  for (const Simd simd : EachSimd()) {
    const uint32_t most =
        placeSplats(screen.data(), entries.data(), count, 64, 96, splats.data(), sets.data(), column.data())
            .most;
    uint32_t expectedMost = 0;
    for (int block = 0; block < kBlocks; ++block) {
      const int x = 64 + block % kBlocksPerRow * kBlockSize, y = 96 + block / kBlocksPerRow * kBlockSize;
      uint32_t inBlock = 0;
      for (uint32_t i = 0; i < groupsOf(count) * kGroup; ++i) {
        bool expected = false;
        if (i < count) {
          const PixelBox& box = screen[entries[i]].box;
          expected = box.x0 < x + kBlockSize && x < box.x1 && box.y0 < y + kBlockSize && y < box.y1;
          EXPECT_EQ(column[i], i);
        }
        inBlock += expected;
        EXPECT_EQ(sets[i / kGroup * kBlocks + static_cast<uint32_t>(block)] >> i % kGroup & 1, expected)
            << nameOf(simd);
      }
      expectedMost = std::max(expectedMost, inBlock);
    }
    EXPECT_EQ(most, expectedMost);
  }
}

} // namespace
} // namespace surflect::splat
