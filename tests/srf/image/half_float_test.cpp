#include "srf/image/half_float.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace surflect::image {
namespace {

double valueOf(uint16_t half) { // [IEEE 754-2008, 3.4]
  const int exponent = half >> 10 & 31, mantissa = half & 1023;
  const double size = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
  return half & 0x8000 ? -size : size;
}

TEST(NearestHalf, EveryHalfIsItself) {
  for (uint32_t half = 0; half < 0x10000; ++half)
    if ((half & 0x7c00) != 0x7c00) {
      EXPECT_EQ(nearestHalf(static_cast<float>(valueOf(static_cast<uint16_t>(half)))), half);
    }
}

TEST(NearestHalf, BetweenTwoTheNearerWinsAndTheEvenOneOfEquals) {
  for (uint16_t half = 0; half < 0x7bff; ++half) {
    const auto middle =
        static_cast<float>((valueOf(half) + valueOf(static_cast<uint16_t>(half + 1))) / 2); // exact
    ASSERT_EQ(nearestHalf(std::nextafter(middle, 0.f)), half);
    ASSERT_EQ(nearestHalf(middle), half + half % 2);
    ASSERT_EQ(nearestHalf(std::nextafter(middle, 1e9f)), half + 1);
    ASSERT_EQ(nearestHalf(-middle), 0x8000 | (half + half % 2));
  }
}

TEST(NearestHalf, OnlyTheFiniteIsClamped) {
  using Limits = std::numeric_limits<float>;
  for (const float large : {65504.f, 65505.f, 65520.f, 1e6f, Limits::max()}) {
    EXPECT_EQ(nearestHalf(large), 0x7bff);
    EXPECT_EQ(nearestHalf(-large), 0xfbff);
  }
  EXPECT_EQ(nearestHalf(Limits::infinity()), 0x7c00);
  EXPECT_EQ(nearestHalf(-Limits::infinity()), 0xfc00);
  for (const uint32_t bits : {0x7f800001u, 0x7fc00000u, 0xffffffffu})
    EXPECT_GT(nearestHalf(std::bit_cast<float>(bits)) & 0x7fff, 0x7c00);
  EXPECT_EQ(nearestHalf(Limits::denorm_min()), 0);
}

TEST(FiniteHalf, IsTheNearestHalfWhereThatIsFinite) {
  using Limits = std::numeric_limits<float>;
  for (uint32_t bits = 0; bits < 0x10000; ++bits)
    if (const float value = floatOfHalf(static_cast<uint16_t>(bits)); std::isfinite(value)) {
      ASSERT_EQ(finiteHalf(value), bits);
    }
  EXPECT_EQ(finiteHalf(Limits::infinity()), 0x7bff);
  EXPECT_EQ(finiteHalf(-Limits::infinity()), 0xfbff);
  EXPECT_EQ(finiteHalf(Limits::quiet_NaN()), 0);
  EXPECT_EQ(finiteHalf(-Limits::quiet_NaN()), 0);
}

TEST(FloatOfHalf, EveryHalfIsExact) {
  for (uint32_t bits = 0; bits < 0x10000; ++bits) {
    const auto half = static_cast<uint16_t>(bits);
    const float value = floatOfHalf(half);
    if ((half & 0x7c00) != 0x7c00) {
      ASSERT_EQ(value, valueOf(half));
      ASSERT_EQ(std::signbit(value), half >> 15);
    } else
      ASSERT_EQ(half & 0x3ff ? std::isnan(value) : std::isinf(value), true);
  }
  EXPECT_LT(floatOfHalf(0xfc00), 0);
}

} // namespace
} // namespace surflect::image
