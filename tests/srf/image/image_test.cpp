#include "srf/image/image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace surflect::image {
namespace {

TEST(Percentile, IsThatOfTheSortedValuesToTwelveBits) {
  std::mt19937 random(1);
  std::lognormal_distribution<float> distribution(-3, 4);
  for (const size_t count : {1, 2, 10, 1000, 30000}) {
    PercentileCounter counter;
    std::vector<float> values(count);
    for (float& value : values) counter.add(value = distribution(random));
    std::ranges::sort(values);
    for (const double share : {0.01, 0.3, 0.5, 0.995, 1.0}) {
      const auto above = static_cast<size_t>((1 - share) * static_cast<double>(count));
      EXPECT_NEAR(counter.percentile(share) / values[count - 1 - above], 1, 0x1p-12);
    }
    EXPECT_EQ(counter.count(), count);
  }
}

TEST(Percentile, WhatIsNotPositiveCountsAsZero) {
  PercentileCounter counter;
  EXPECT_EQ(counter.percentile(0.5), 0);
  for (const float value : {-1.f, 0.f, -0.f, std::numeric_limits<float>::quiet_NaN()}) counter.add(value);
  EXPECT_EQ(counter.percentile(1), 0);
  counter.add(8);
  EXPECT_EQ(counter.percentile(1), 8);
  EXPECT_EQ(counter.percentile(0.5), 0);
}

} // namespace
} // namespace surflect::image
