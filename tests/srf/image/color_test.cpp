#include "srf/image/color.h"

#include "srf/image/srgb_bytes.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace surflect::image {
namespace {

TEST(Color, SrgbCurveAndItsInverseCancel) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1, 8);
  for (int i = 0; i < 100000; ++i) {
    const float x = value(random);
    EXPECT_NEAR(srgbFromLinear(linearFromSrgb(x)), x, 3.6e-7f * std::max(1.f, std::abs(x)));
    EXPECT_NEAR(linearFromSrgb(srgbFromLinear(x)), x, 5.9e-7f * std::max(1.f, std::abs(x)));
  }
}

TEST(Color, SrgbBytesAreTheNearestToTheCurve) {
  const SrgbBytes bytes;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> value(0, 1), exponent(-20, 0);
  const auto expectNearest = [&](float x) {
    ASSERT_EQ(bytes(x), std::lround(255 * srgbFromLinear(x))) << std::hexfloat << x;
  };
  for (int i = 0; i < 100000; ++i) {
    expectNearest(value(random));
    expectNearest(std::exp2(exponent(random)));
  }
  for (int byte = 0; byte < 255; ++byte) { // about the thresholds
    float x = linearFromSrgb((static_cast<float>(byte) + 0.5f) / 255);
    for (int i = 0; i < 8; ++i) x = std::nextafter(x, 0.f);
    for (int i = 0; i < 16; ++i, x = std::nextafter(x, 1.f)) expectNearest(x);
  }
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(bytes(-1), 0);
  EXPECT_EQ(bytes(0), 0);
  EXPECT_EQ(bytes(1), 255);
  EXPECT_EQ(bytes(infinity), 255);
  EXPECT_EQ(bytes(std::numeric_limits<float>::quiet_NaN()), 0);
}

TEST(Color, SrgbCurveKeepsBlackAndWhite) {
  EXPECT_EQ(linearFromSrgb(0), 0);
  EXPECT_FLOAT_EQ(linearFromSrgb(1), 1);
  EXPECT_NEAR(linearFromSrgb(0.5f), 0.2140f, 5e-5f); // the standard's middle grey
}

TEST(Color, SrgbCurveRisesWithoutAStep) {
  for (int i = 0; i < 10000; ++i) {
    const float x = static_cast<float>(i) / 10000, next = static_cast<float>(i + 1) / 10000;
    EXPECT_LT(linearFromSrgb(x), linearFromSrgb(next));
    EXPECT_LT(linearFromSrgb(next) - linearFromSrgb(x), 2.4e-4f); // slope of at most 2.28
  }
}

TEST(Color, LumaOfGrayIsTheGray) {
  for (float gray = 0; gray < 10; gray += 0.37f) EXPECT_FLOAT_EQ(luma({gray, gray, gray}), gray);
}

} // namespace
} // namespace surflect::image
