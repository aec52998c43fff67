#include "render/lightfield/lfm/quantization.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace surflect::lfm {
namespace {

std::vector<float> randomMap(float least, float most) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(least, most);
  std::vector<float> map(500);
  for (float& x : map) x = value(random);
  return map;
}

TEST(Quantization, EveryCodeIsThatOfItsValue) {
  for (int code = -127; code <= 127; ++code)
    EXPECT_EQ(snorm8Of(decodedSnorm8(static_cast<int8_t>(code))), code);
  for (int code = 0; code <= 255; ++code)
    EXPECT_EQ(unorm8Of(decodedUnorm8(static_cast<uint8_t>(code))), code);
  EXPECT_EQ(decodedSnorm8(-128), -1);
}

TEST(Quantization, ErrorsAreAtMostHalfAStep) {
  const std::vector<float> signs = randomMap(-3, 2), positive = randomMap(0, 0.01f);
  const float scale = scaleOf(signs), small = scaleOf(positive);
  const std::vector<float> decodedSigns = decoded(snorm8Of(signs, scale), scale),
                           decodedPositive = decoded(unorm8Of(positive, small), small);
  for (size_t i = 0; i < signs.size(); ++i) {
    EXPECT_LE(std::abs(decodedSigns[i] - signs[i]), scale / 254 * 1.0001f);
    EXPECT_LE(std::abs(decodedPositive[i] - positive[i]), small / 510 * 1.0001f);
  }
}

TEST(Quantization, ZeroIsExactAndTheLargestValueNearlySo) {
  const std::vector<float> map = {0, -0.7f, 0.7f, 0.1f};
  const std::vector<float> result = decoded(snorm8Of(map, scaleOf(map)), scaleOf(map));
  EXPECT_EQ(result[0], 0);
  EXPECT_FLOAT_EQ(result[1], -0.7f);
  EXPECT_FLOAT_EQ(result[2], 0.7f);
}

TEST(Quantization, ValuesBeyondTheScaleAreClampedAndNoScaleMeansZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinite = std::numeric_limits<float>::infinity();
  const std::vector<float> map = {2, -2, nan, infinite, -infinite};
  EXPECT_EQ(snorm8Of(map, 1), (std::vector<int8_t>{127, -127, 0, 127, -127}));
  EXPECT_EQ(unorm8Of(map, 1), (std::vector<uint8_t>{255, 0, 0, 255, 0}));
  EXPECT_EQ(snorm8Of(map, 0), (std::vector<int8_t>{0, 0, 0, 0, 0}));
}

TEST(Quantization, BiasedCodesKeepTheirOrder) {
  for (int code = -128; code <= 127; ++code) {
    EXPECT_EQ(biased(static_cast<int8_t>(code)), code + 128);
    EXPECT_EQ(unbiased(biased(static_cast<int8_t>(code))), code);
  }
}

} // namespace
} // namespace surflect::lfm
