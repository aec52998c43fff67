#include "surfel/base/step_progress.h"

#include <gtest/gtest.h>

#include <string>
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
} // namespace surflect
