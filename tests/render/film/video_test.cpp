#include "render/film/video.h"

#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <set>
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

// The codec keeps alpha without loss, in 10 bits.
TEST(Video, ProResHasMoreThanTheCodesOfEightBits) {
  ASSERT_TRUE(canEncodeVideo());
  const image::TemporaryFolder folder;
  constexpr int kSide = 64;
  method::FrameLayers film{image::Image(kSide, kSide, 4), {}};
  for (size_t i = 0; i < kSide * kSide; ++i)
    film.color.values[4 * i + 3] = static_cast<float>(i) / (kSide * kSide - 1);
  VideoWriter video(folder / "film.mov", VideoFormat::proRes4444, kSide, kSide, 24);
  video.add(shownColor(film, {.isTransparent = true, .bits = bitsOf(VideoFormat::proRes4444)}));
  video.finish();
  const std::string command = "ffmpeg -v error -i '" + (folder / "film.mov").string() +
                              "' -vf alphaextract -pix_fmt gray16le -f rawvideo -";
  const std::unique_ptr<FILE, int (*)(FILE*)> decoded(::popen(command.c_str(), "r"), ::pclose);
  std::set<uint16_t> codes;
  size_t pixels = 0;
  for (uint16_t code = 0; std::fread(&code, sizeof code, 1, decoded.get()) == 1; ++pixels) {
    codes.insert(code);
    EXPECT_NEAR(code / 65535., film.color.values[4 * pixels + 3], 1.1 / 1023);
  }
  EXPECT_EQ(pixels, size_t{kSide * kSide});
  EXPECT_GT(codes.size(), 1000u);
}

} // namespace
} // namespace surflect::film
