#include "surfel/math/double_lanes_scalar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace surflect {
namespace {

TEST(DoubleLanes, TriplesComeApartAndTogetherAgain) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  float in[24], out[24];
  for (float& x : in) x = normal(random);
  const DoubleTriples triples = loadTriples(in);
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(at(triples.x, i), double{in[3 * i]});
    EXPECT_EQ(at(triples.y, i), double{in[3 * i + 1]});
    EXPECT_EQ(at(triples.z, i), double{in[3 * i + 2]});
  }
  storeTriples(out, triples);
  for (int i = 0; i < 24; ++i) EXPECT_EQ(out[i], in[i]);
}

TEST(DoubleLanes, WhatIsNotANumberPassesAsSecondOperand) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double numbers[8] = {nan, 1, 2, 3, -4, 5, 6, 7};
  const DoubleLanes least = min(2, load(numbers)), most = max(2, load(numbers));
  EXPECT_TRUE(std::isnan(at(least, 0)) && std::isnan(at(most, 0)));
  for (int i = 1; i < 8; ++i) {
    EXPECT_EQ(at(least, i), std::min(2.0, numbers[i]));
    EXPECT_EQ(at(most, i), std::max(2.0, numbers[i]));
  }
  EXPECT_EQ(bitsOfLess(load(numbers), 3), 0b00010110u); // no bit for what is not a number
  EXPECT_EQ(bitsOfLess(2, load(numbers)), 0b11101000u);
}

TEST(DoubleLanes, RoundToFloatAndBack) {
  const double numbers[8] = {0.1, -1e300, 1e-60, 3, 1 + 0x1p-30, -0.0, 1e38, 0x1.ffffffp127};
  const DoubleLanes rounded = roundedToFloat(load(numbers));
  for (int i = 0; i < 8; ++i) EXPECT_EQ(at(rounded, i), double{static_cast<float>(numbers[i])});
}

} // namespace
} // namespace surflect
