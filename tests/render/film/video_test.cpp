#include "render/film/video.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

namespace surflect::film {
namespace {

std::pair<int, int> rateOf(double framesPerSecond) {
  const image::FrameRate rate = frameRate(framesPerSecond);
  return {rate.numerator, rate.denominator};
}

TEST(Video, RatesOfNtscAreThoseInAnySpelling) {
  for (const int whole : {24, 30, 48, 60, 120})
    for (const double unit : {1e-2, 1e-3, 1e-4, 1e-9}) {
      const double written = std::round(whole / 1.001 / unit) * unit; // 23.98, 23.976, 23.9760
      EXPECT_EQ(rateOf(written), std::pair(1000 * whole, 1001)) << written;
      EXPECT_EQ(rateOf(written / 2), std::pair(500 * whole, 1001)) << "every second frame of " << written;
    }
}

TEST(Video, OtherRatesAreTheirFractions) {
  EXPECT_EQ(rateOf(24), std::pair(24, 1));
  EXPECT_EQ(rateOf(25), std::pair(25, 1));
  EXPECT_EQ(rateOf(12.5), std::pair(25, 2));
  EXPECT_EQ(rateOf(24 / 7.0), std::pair(24, 7));
  EXPECT_EQ(rateOf(0.001), std::pair(1, 1000));
  EXPECT_EQ(rateOf(1e-9), std::pair(1, 1'000'000'000));
  EXPECT_EQ(rateOf(1e6), std::pair(1'000'000, 1));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> logarithm(-9, 6);
  for (int i = 0; i < 100000; ++i) {
    const double rate = std::pow(10, logarithm(random));
    const auto [numerator, denominator] = rateOf(rate);
    EXPECT_NEAR(numerator / (rate * denominator), 1, 2.1e-4) << rate;
    if (rate > 241) {
      EXPECT_NEAR(numerator / (rate * denominator), 1, 1e-9) << rate;
    }
  }
}

TEST(Video, AlphaIsKeptByMovAlone) {
  EXPECT_EQ(videoFormat("film.mp4", true), VideoFormat::h264);
  EXPECT_EQ(videoFormat("film.mp4", false), VideoFormat::h264);
  EXPECT_EQ(videoFormat("film.mov", true), VideoFormat::proRes4444);
  EXPECT_EQ(videoFormat("film.mov", false), VideoFormat::proRes422);
}

} // namespace
} // namespace surflect::film
