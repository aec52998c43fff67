#include "surfel/base/stopwatch.h"

#include <gtest/gtest.h>

#include <thread>

namespace surflect {
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
