#include "render/stage/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <vector>

namespace surflect::stage {
namespace {

// Uniform numbers in [0, 1): the mean is within 5 standard deviations, and neighbours are uncorrelated.
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

// Positions of two cells over many shuffles: all are equally frequent, within 5 standard deviations; likewise
// of one cell in two successive shuffles.
TEST(Strata, ShufflesDoNotKnowOfEachOther) {
  Random random{6};
  const Strata strata(6);
  constexpr size_t count = 6;
  constexpr int trials = 60000;
  std::vector<int> together(count * count), twice(count * count);
  for (int trial = 0; trial < trials; ++trial) {
    const auto one = strata.shuffled(random), other = strata.shuffled(random);
    ++together[one[3] * count + one[4]];
    ++twice[one[2] * count + other[2]];
  }
  const auto expectNear = [](double found, double expected) {
    EXPECT_NEAR(found, expected, 5 * std::sqrt(expected));
  };
  for (size_t i = 0; i < count; ++i)
    for (size_t j = 0; j < count; ++j) {
      expectNear(twice[i * count + j], trials / 36.0);
      if (i != j) expectNear(together[i * count + j], trials / 30.0);
    }
}

TEST(Strata, GiveEachCellOneSample) {
  Random random{7};
  for (const auto& [samples, columns, rows] : {std::array{16, 4, 4}, {12, 4, 3}, {7, 7, 1}, {1, 1, 1}}) {
    const Strata strata(static_cast<uint32_t>(samples));
    std::set<std::pair<int, int>> cells;
    for (const uint32_t cell : strata.shuffled(random)) {
      const auto [u, v] = strata.in(cell, random);
      cells.insert(std::pair(static_cast<int>(u * columns), static_cast<int>(v * rows)));
      EXPECT_TRUE(u >= 0 && u < 1 && v >= 0 && v < 1);
    }
    EXPECT_EQ(cells.size(), static_cast<size_t>(samples));
  }
}

} // namespace
} // namespace surflect::stage
