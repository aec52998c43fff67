#include "surfel/base/time.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

namespace surflect {

namespace {

TEST(StepProgress, StepsTogetherAreTheWholeStage) {
  std::vector<double> fractions;
  Progress whole;
  whole.report = [&](std::string_view stage, double fraction) {
    EXPECT_EQ(stage, "work");
    fractions.push_back(fraction);
  };
  for (size_t i = 0; i < 4; ++i) {
    const Progress step = stepOf(whole, "work", i, 4);
    step("of the step", 0.5);
    step("of the step", 1);
  }
  EXPECT_EQ(fractions, (std::vector{0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.}));
}

TEST(StepProgress, StopsWhereTheWholeDoes) {
  Progress whole;
  bool stop = false;
  whole.cancelled = [&] { return stop; };
  const Progress step = stepOf(whole, "work", 0, 2);
  step("", 0);
  stop = true;
  EXPECT_THROW(step("", 0.5), Cancelled);
}

} // namespace

namespace {

TEST(Stopwatch, RunsOnAndFindsWhatHasPassed) {
  const Stopwatch outer;
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const Stopwatch inner;
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const double later = inner.seconds(), all = outer.seconds();
  EXPECT_GE(later, 0.005);
  EXPECT_GE(all, later + 0.02);
}

} // namespace

} // namespace surflect
