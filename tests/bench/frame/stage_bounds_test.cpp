#include "bench/frame/stage_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace surflect::bench {
namespace {

FrameCounts paperDoll() {
  return {.surfels = 532'935,
          .drawn = 240'000,
          .visible = 230'000,
          .pixels = 1024 * 768,
          .contributions = 5'000'000,
          .views = 432,
          .rigLights = 60,
          .lights = 5,
          .pairs = 910'000,
          .lookups = 14'000'000,
          .blocks = 100'000,
          .blockBytes = 150'000'000,
          .rank = 6};
}

StageWork workOf(const FrameCounts& counts, std::string_view stage) {
  const auto works = workOf(counts);
  return *std::ranges::find(works, stage, &StageWork::stage);
}

TEST(StageBounds, EveryStageHasWork) {
  const auto works = workOf(paperDoll());
  ASSERT_EQ(works.size(), std::size(kStages));
  for (size_t i = 0; i < works.size(); ++i) {
    EXPECT_EQ(works[i].stage, kStages[i]);
    EXPECT_GT(works[i].bytes, 0);
    EXPECT_GT(works[i].operations, 0);
  }
}

// Work is a sum over surfels, pairs and pixels: doubling all of these counts doubles the work.
TEST(StageBounds, WorkIsLinear) {
  const FrameCounts once = paperDoll();
  FrameCounts twice = once;
  for (size_t* count : {&twice.surfels, &twice.drawn, &twice.visible, &twice.pixels, &twice.contributions})
    *count *= 2;
  for (uint64_t* count : {&twice.pairs, &twice.lookups, &twice.blocks, &twice.blockBytes}) *count *= 2;
  for (const std::string_view stage : kStages) {
    EXPECT_DOUBLE_EQ(workOf(twice, stage).bytes, 2 * workOf(once, stage).bytes) << stage;
    EXPECT_DOUBLE_EQ(workOf(twice, stage).operations, 2 * workOf(once, stage).operations) << stage;
  }
}

// Only ULR depends on the numbers of views and lights of the rig.
TEST(StageBounds, OnlyUlrDependsOnTheSizeOfTheRig) {
  FrameCounts more = paperDoll();
  more.views *= 4;
  more.rigLights *= 4;
  for (const std::string_view stage : kStages) {
    EXPECT_EQ(workOf(more, stage).operations > workOf(paperDoll(), stage).operations, stage == "ulr")
        << stage;
  }
}

TEST(StageBounds, TheSlowerOfTwoBounds) {
  const MachineLimits limits{.threads = 2, .bytesPerSecond = 8, .flopsPerSecond = 16};
  EXPECT_DOUBLE_EQ(boundSeconds({"", 16, 16}, limits), 2);
  EXPECT_TRUE(isBoundByMemory({"", 16, 16}, limits));
  EXPECT_DOUBLE_EQ(boundSeconds({"", 16, 64}, limits), 4);
  EXPECT_FALSE(isBoundByMemory({"", 16, 64}, limits));
}

} // namespace
} // namespace surflect::bench
