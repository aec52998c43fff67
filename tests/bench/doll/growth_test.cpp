#include "bench/doll/growth.h"

#include "bench/doll/doll_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace surflect::bench {
namespace {

GrowthStep step(size_t from, size_t to, double time, double error = 0) {
  return {0, 1, from, to, {time, error}};
}

TEST(Growth, TimeInProportionIsThePowerOfOne) {
  const GrowthSweep sweep{"", {step(10, 20, 2), step(20, 60, 3)}};
  EXPECT_DOUBLE_EQ(sweep.exponent(), 1);
  EXPECT_DOUBLE_EQ(sweep.worst().median, 1);
}

TEST(Growth, SquaresAreThePowerOfTwo) {
  EXPECT_DOUBLE_EQ((GrowthSweep{"", {step(1, 2, 4), step(2, 4, 4)}}).exponent(), 2);
}

// What the first step saves does not hide that the last takes more than it should.
TEST(Growth, TheWorstStepCounts) {
  const GrowthSweep sweep{"", {step(1, 4, 2, 0.1), step(4, 8, 3, 0.2), step(8, 16, 1)}};
  EXPECT_LT(sweep.exponent(), 1);
  EXPECT_DOUBLE_EQ(sweep.worst().median, 1.5);
  EXPECT_DOUBLE_EQ(sweep.worst().error, 0.1);
}

class GrowthOfDoll : public testing::Test {
protected:
  ~GrowthOfDoll() override { std::filesystem::remove_all(folder_); }
  model::Model model(size_t views) const {
    std::filesystem::remove_all(folder_);
    writeDollModel(folder_, {.surfels = 1000, .views = views, .lights = 6, .width = 64, .height = 80});
    return model::openModel(folder_);
  }
  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) /
                                  testing::UnitTest::GetInstance()->current_test_info()->name();
};

const GrowthSweep& sweepOf(const Growth& growth, std::string_view what) {
  return *std::ranges::find(growth.sweeps, what, &GrowthSweep::what);
}

TEST_F(GrowthOfDoll, RowsHaveTheSizesOfTheirSteps) {
  const Growth growth = measureGrowth(model(8), 96, 72, 2);
  EXPECT_EQ(growth.rows.size(), 10u);
  ASSERT_EQ(growth.sweeps.size(), 4u);
  const auto sizes = [&](std::string_view what, size_t FrameCounts::*size) {
    std::vector<size_t> all;
    for (const GrowthStep& s : sweepOf(growth, what).steps) {
      EXPECT_EQ(s.fromSize, growth.rows[s.from].times.counts.*size);
      EXPECT_EQ(s.toSize, growth.rows[s.to].times.counts.*size);
      EXPECT_GT(s.frame.median, 0);
      if (all.empty()) all.push_back(s.fromSize);
      EXPECT_EQ(all.back(), s.fromSize);
      all.push_back(s.toSize);
    }
    return all;
  };
  EXPECT_EQ(sizes("views", &FrameCounts::views), (std::vector<size_t>{2, 4, 8}));
  EXPECT_EQ(sizes("lights", &FrameCounts::lights), (std::vector<size_t>{1, 5, 60}));
  EXPECT_EQ(sizes("pixels", &FrameCounts::pixels), (std::vector<size_t>{96 * 72, 4 * 96 * 72}));
  const auto surfels = sizes("surfels", &FrameCounts::surfels);
  ASSERT_EQ(surfels.size(), 3u);
  EXPECT_NEAR(static_cast<double>(surfels[1]), 2000, 200);
  EXPECT_NEAR(static_cast<double>(surfels[2]), 4000, 400);
  EXPECT_GT(growth.sixtyLights.median, 0);
  EXPECT_GT(growth.environment.median, 0);
}

// Between the rows of a sweep nothing else differs.
TEST_F(GrowthOfDoll, OneThingGrowsAtATime) {
  const Growth growth = measureGrowth(model(8), 96, 72, 1);
  for (const GrowthSweep& sweep : growth.sweeps)
    for (const GrowthStep& s : sweep.steps) {
      const FrameCounts &from = growth.rows[s.from].times.counts, &to = growth.rows[s.to].times.counts;
      EXPECT_EQ(from.views != to.views, sweep.what == "views");
      EXPECT_EQ(from.lights != to.lights, sweep.what == "lights");
      EXPECT_EQ(from.pixels != to.pixels, sweep.what == "pixels");
      EXPECT_EQ(from.surfels != to.surfels, sweep.what == "surfels");
      EXPECT_EQ(from.environments + to.environments, 0u);
    }
}

TEST_F(GrowthOfDoll, OneRowIsLitByAnEnvironment) {
  const Growth growth = measureGrowth(model(4), 96, 72, 1);
  const auto isLit = [](const GrowthRow& row) { return row.times.counts.environments > 0; };
  ASSERT_EQ(std::ranges::count_if(growth.rows, isLit), 1);
  const FrameCounts& counts = std::ranges::find_if(growth.rows, isLit)->times.counts;
  EXPECT_EQ(counts.lights, 0u);
  EXPECT_GT(counts.directions, 10u);
  EXPECT_GT(counts.lookups, counts.pairs); // some captured lights have weight
}

TEST_F(GrowthOfDoll, ViewsOfOneDoNotGrow) {
  const Growth growth = measureGrowth(model(1), 96, 72, 1);
  EXPECT_EQ(std::ranges::count(growth.sweeps, "views", &GrowthSweep::what), 0);
  EXPECT_EQ(growth.sweeps.size(), 3u);
}

TEST_F(GrowthOfDoll, OtherObjectsHaveNoMoreSurfels) {
  model::Model other = model(4);
  other.rig.views[0].camera.lens.focalX *= 1.01;
  const Growth growth = measureGrowth(other, 96, 72, 1);
  EXPECT_EQ(std::ranges::count(growth.sweeps, "surfels", &GrowthSweep::what), 0);
}

} // namespace
} // namespace surflect::bench
