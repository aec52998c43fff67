#include "render/evaluation/rank_correlation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace surflect::evaluation {
namespace {

std::vector<double> randomValues(size_t count, uint32_t seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> values(count);
  for (double& value : values) value = uniform(rng);
  return values;
}

std::vector<double> mapped(std::vector<double> values, double (*function)(double)) {
  std::ranges::transform(values, values.begin(), function);
  return values;
}

TEST(RankCorrelation, EqualValuesShareTheMeanOfTheirRanks) {
  EXPECT_EQ(ranksOf(std::vector<double>{5, 1, 5, 5, 0}), (std::vector<double>{3, 1, 3, 3, 0}));
}

TEST(RankCorrelation, IsOneForAnyRisingFunctionAndMinusOneForAnyFallingOne) {
  const std::vector<double> a = randomValues(500, 1);
  const auto rising = [](double x) { return std::exp(3 * x); };
  const auto falling = [](double x) { return -x * x * x; };
  EXPECT_NEAR(rankCorrelation(a, mapped(a, rising)).value(), 1, 1e-12);
  EXPECT_NEAR(rankCorrelation(a, mapped(a, falling)).value(), -1, 1e-12);
}

TEST(RankCorrelation, OfIndependentValuesIsNearZero) {
  EXPECT_LT(std::abs(rankCorrelation(randomValues(4000, 1), randomValues(4000, 2)).value()), 0.05);
}

// Without ties it is 1 - 6 sum d^2 / (n (n^2 - 1)), where d is the difference of ranks.
TEST(RankCorrelation, IsTheClosedFormWithoutTies) {
  const std::vector<double> a = randomValues(40, 3), b = randomValues(40, 4);
  const std::vector<double> ranksA = ranksOf(a), ranksB = ranksOf(b);
  double squares = 0;
  for (size_t i = 0; i < a.size(); ++i) squares += (ranksA[i] - ranksB[i]) * (ranksA[i] - ranksB[i]);
  EXPECT_NEAR(rankCorrelation(a, b).value(), 1 - 6 * squares / (40 * (40 * 40 - 1)), 1e-12);
}

TEST(RankCorrelation, DoesNotDependOnTheOrderInWhichTiesAreListed) {
  const std::vector<double> a{1, 1, 2, 2, 3, 3}, b{1, 2, 3, 4, 5, 6}, swapped{2, 1, 4, 3, 6, 5};
  EXPECT_DOUBLE_EQ(rankCorrelation(a, b).value(), rankCorrelation(a, swapped).value());
  EXPECT_LT(rankCorrelation(a, b).value(), 1);
}

TEST(RankCorrelation, IsNothingForAConstant) {
  EXPECT_FALSE(rankCorrelation(std::vector<double>{1, 2, 3}, std::vector<double>{4, 4, 4}));
  EXPECT_FALSE(rankCorrelation(std::vector<double>{1}, std::vector<double>{2}));
  EXPECT_FALSE(rankCorrelation({}, {}));
}

} // namespace
} // namespace surflect::evaluation
