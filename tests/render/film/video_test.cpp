#include "render/film/video.h"

#include <gtest/gtest.h>

namespace surflect::film {
namespace {

TEST(Video, RatesOfNtscAreFractions) {
  EXPECT_EQ(rateText(23.976), "24000/1001");
  EXPECT_EQ(rateText(23.98), "24000/1001");
  EXPECT_EQ(rateText(23.97), "23.97");
  EXPECT_EQ(rateText(29.97), "30000/1001");
  EXPECT_EQ(rateText(59.94), "60000/1001");
  EXPECT_EQ(rateText(119.88), "120000/1001");
  EXPECT_EQ(rateText(24), "24");
  EXPECT_EQ(rateText(25), "25");
  EXPECT_EQ(rateText(12.5), "12.5");
  EXPECT_EQ(rateText(0.001), "0.001");
}

TEST(Video, AlphaIsKeptByMovAlone) {
  EXPECT_EQ(videoFormat("film.mp4", true), VideoFormat::h264);
  EXPECT_EQ(videoFormat("film.mp4", false), VideoFormat::h264);
  EXPECT_EQ(videoFormat("film.mov", true), VideoFormat::proRes4444);
  EXPECT_EQ(videoFormat("film.mov", false), VideoFormat::proRes422);
}

} // namespace
} // namespace surflect::film
