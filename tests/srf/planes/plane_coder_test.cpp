#include "srf/planes/plane_coder.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect::planes {
namespace {

std::vector<uint8_t> waves(int width, int height) {
  std::vector<uint8_t> grey;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      grey.push_back(static_cast<uint8_t>(std::lround(127 + 100 * std::sin(0.1 * x) * std::cos(0.07 * y))));
  return grey;
}

TEST(PlaneCoder, ValuesComeBackWithinHalfAStepOfTheirRange) {
  const std::vector<float> values{-3, -1.234f, 0.5f, 7};
  const PlaneRange range = rangeOf(values);
  for (const float value : values)
    EXPECT_NEAR(valueOf(range, byteOf(range, value)), value, 0.5f * 10 / 255 + 1e-5f);
  EXPECT_EQ(byteOf(range, -100), 0);
  EXPECT_EQ(byteOf(range, 100), 255);
  EXPECT_EQ(valueOf(rangeOf(std::vector<float>{2, 2}), 0), 2);
}

TEST(PlaneCoder, AJpegComesBackAlmostAsItWas) {
  const std::vector<uint8_t> grey = waves(70, 45);
  const std::vector<uint8_t> back = greyOf(greyJpeg(grey, 70, 45, 100), 70, 45);
  for (size_t i = 0; i < grey.size(); ++i) EXPECT_NEAR(back[i], grey[i], 1);
}

TEST(PlaneCoder, StepsAreEqualInThePlanesOwnUnit) {
  std::vector<PlaneRange> ranges{{-4, 4}, {-1, 1}, {0, 0.5f}};
  shareSteps(ranges, 90);
  EXPECT_EQ(ranges[0].quality, 90);
  for (const PlaneRange& range : ranges)
    EXPECT_NEAR(stepsOf(range.quality) * static_cast<double>(range.most - range.least), 8 * stepsOf(90), 5);
}

TEST(PlaneCoder, EveryTruncationIsRefused) {
  const std::string jpeg = greyJpeg(waves(40, 40), 40, 40, 80);
  for (size_t length = 0; length + 2 < jpeg.size(); length += 7) // the last two bytes only end the file
    EXPECT_THROW(greyOf(std::string_view(jpeg).substr(0, length), 40, 40), Error) << length;
  EXPECT_THROW(greyOf(jpeg, 41, 40), Error);
}

} // namespace
} // namespace surflect::planes
