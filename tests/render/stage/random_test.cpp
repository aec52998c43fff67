#include "render/stage/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace surflect {
namespace {

// Of numbers even in [0, 1): the mean within 5 standard deviations, and neighbours uncorrelated.
void expectEven(const std::vector<double>& values) {
  const double n = static_cast<double>(values.size());
  double mean = 0, product = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    ASSERT_GE(values[i], 0);
    ASSERT_LT(values[i], 1);
    mean += values[i] / n;
    product += (values[i] - 0.5) * (values[(i + 1) % values.size()] - 0.5) / n;
  }
  EXPECT_NEAR(mean, 0.5, 5 * std::sqrt(1 / (12 * n)));
  EXPECT_NEAR(product, 0, 5 / (12 * std::sqrt(n)));
}

TEST(StageRandom, IsEvenAlongAStreamAndAcrossStreams) {
  std::vector<double> along, acrossFirst, acrossLast;
  Random stream{1, 2, 3, 4};
  for (uint64_t i = 0; i < 100000; ++i) {
    along.push_back(stream.next());
    acrossFirst.push_back(Random({i, 2, 3, 4}).next());
    acrossLast.push_back(Random({1, 2, 3, i}).next());
  }
  expectEven(along);
  expectEven(acrossFirst);
  expectEven(acrossLast);
}

TEST(StageRandom, KeysInAnotherOrderAreAnotherStream) {
  std::set<double> firsts;
  for (uint64_t i = 0; i < 30; ++i)
    for (uint64_t j = 0; j < 30; ++j) firsts.insert(Random({i, j}).next());
  EXPECT_EQ(firsts.size(), 900u);
}

} // namespace
} // namespace surflect
