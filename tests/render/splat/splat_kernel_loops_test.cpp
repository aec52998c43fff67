#include "render/splat/splat_kernel_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace surflect::splat {
namespace {

TEST(SplatKernelLoops, TheColorWeightIsWithin8e6OfItselfUpToTheCutOff) {
  double worst = 0;
  for (int i = 0; i <= 20'000; ++i) {
    const float t = static_cast<float>(i) / 20'000;
    float got[kLanes];
    store(got, colorWeight(broadcast(t)));
    worst =
        std::max(worst, std::abs(got[0] / std::exp(-kCutoffSigmas * kCutoffSigmas * (1 - double{t})) - 1));
  }
  EXPECT_LT(worst, 8e-6);
}

TEST(SplatKernelLoops, TurnedSetsHaveForEachBlockWhatTheyHadForEachSplat) {
  std::mt19937_64 random(1);
  constexpr uint32_t groups = 2;
  std::vector<uint64_t> ofSplats(kGroup * groups);
  for (uint64_t& set : ofSplats) set = random();
  std::vector<uint64_t> ofBlocks = ofSplats;
  turnSets(ofBlocks.data(), groups);
  for (uint32_t splat = 0; splat < kGroup * groups; ++splat)
    for (uint32_t block = 0; block < kBlocks; ++block)
      EXPECT_EQ(ofBlocks[splat / kGroup * kBlocks + block] >> splat % kGroup & 1,
                ofSplats[splat] >> block & 1);
}

TEST(SplatKernelLoops, ABoxIsOverTheBlocksOfItsPixels) {
  for (int x0 = -5; x0 < kTileSize; x0 += 3)
    for (int x1 = std::max(x0, 0) + 1; x1 < kTileSize + 5; x1 += 3)
      for (const auto& [y0, y1] : {std::pair{-2, 1}, {0, 32}, {7, 9}, {31, 40}}) {
        uint64_t expected = 0;
        for (int y = std::max(y0, 0); y < std::min(y1, kTileSize); ++y)
          for (int x = std::max(x0, 0); x < std::min(x1, kTileSize); ++x)
            expected |= uint64_t{1} << (y / kBlockSize * kBlocksPerRow + x / kBlockSize);
        EXPECT_EQ(blocksUnder({x0 + 64, y0 + 96, x1 + 64, y1 + 96}, 64, 96), expected);
      }
}

} // namespace
} // namespace surflect::splat
