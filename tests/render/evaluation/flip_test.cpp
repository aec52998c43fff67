#include "render/evaluation/flip.h"

#include "srf/image/color.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace surflect::evaluation {
namespace {

image::Image constantImage(int width, int height, Rgb color) {
  image::Image image(width, height, 3);
  for (size_t i = 0; i < image.values.size(); i += 3)
    image.values[i] = color.r, image.values[i + 1] = color.g, image.values[i + 2] = color.b;
  return image;
}

// Smooth colours with some noise.
image::Image randomImage(unsigned seed, int width, int height, float noise) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  const double fx = uniform(rng), fy = uniform(rng);
  image::Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (size_t c = 0; c < 3; ++c) {
        const double smooth = 0.5 + 0.4 * std::sin(fx * x + static_cast<double>(c)) * std::cos(fy * y);
        image.at(x, y)[c] = std::clamp(static_cast<float>(smooth) + noise * (uniform(rng) - 0.5f), 0.f, 1.f);
      }
  return image;
}

image::Image shifted(const image::Image& image, int dx, int dy) {
  image::Image result = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      std::ranges::copy(
          image.at(std::clamp(x - dx, 0, image.width - 1), std::clamp(y - dy, 0, image.height - 1)),
          result.at(x, y).begin());
  return result;
}

float valueOf(Rgb a, Rgb b) { return flip(constantImage(8, 8, a), constantImage(8, 8, b)).at(3, 3)[0]; }

TEST(Flip, EqualPicturesDoNotDiffer) {
  const image::Image image = randomImage(1, 33, 21, 0.5f);
  EXPECT_EQ(std::ranges::max(flip(image, image).values), 0);
}

TEST(Flip, IsSymmetricAndBetweenZeroAndOne) {
  const image::Image a = randomImage(2, 33, 21, 0.9f), b = randomImage(3, 33, 21, 0.9f);
  const image::Image ab = flip(a, b);
  EXPECT_EQ(ab.values, flip(b, a).values);
  for (const float value : ab.values) EXPECT_TRUE(value > 0 && value <= 1);
}

// Black and white: HyAB is 100, the largest is 203.3; green and blue are the largest by definition.
TEST(Flip, KnownColoursHaveKnownDifferences) {
  const double d = std::pow(100, 0.7), largest = std::pow(203.3, 0.7);
  EXPECT_NEAR(valueOf({0, 0, 0}, {1, 1, 1}), 0.95 + 0.05 * (d - 0.4 * largest) / (0.6 * largest), 1e-4);
  EXPECT_NEAR(valueOf({0, 0, 0}, {1, 1, 1}), 0.967, 5e-4);
  EXPECT_NEAR(valueOf({0, 1, 0}, {0, 0, 1}), 1, 1e-6);
}

TEST(Flip, FollowsPicturesThatAreShifted) {
  const image::Image a = randomImage(4, 60, 60, 0.2f), b = randomImage(5, 60, 60, 0.2f);
  const image::Image here = flip(a, b), there = flip(shifted(a, 4, 3), shifted(b, 4, 3));
  for (int y = 20; y < 40; ++y) // beyond the reach of borders
    for (int x = 20; x < 40; ++x) EXPECT_NEAR(here.at(x, y)[0], there.at(x + 4, y + 3)[0], 1e-6);
}

TEST(Flip, LargerErrorsAreLarger) {
  const image::Image image = randomImage(6, 40, 40, 0.1f);
  float last = 0;
  for (const float error : {0.01f, 0.05f, 0.2f}) {
    image::Image other = image;
    for (float& value : other.values) value = std::clamp(value + error, 0.f, 1.f);
    const float now = flip(image, other).at(20, 20)[0];
    EXPECT_GT(now, last);
    last = now;
  }
}

// A lone pixel of noise is less visible than a whole area; from afar it is less visible still.
TEST(Flip, SmallThingsFadeWithDistance) {
  const image::Image gray = constantImage(41, 41, {0.2f, 0.2f, 0.2f});
  image::Image dot = gray;
  std::ranges::fill(dot.at(20, 20), 0.8f);
  const float near = flip(gray, dot, 20).at(20, 20)[0], far = flip(gray, dot, 67).at(20, 20)[0];
  EXPECT_GT(near, far);
  EXPECT_GT(valueOf({0.2f, 0.2f, 0.2f}, {0.8f, 0.8f, 0.8f}), far);
}

// The contrast filter and the edge detector at one pixel, as sums over two dimensions.
TEST(Flip, MatchesThePlainFormForGrays) {
  const auto gray = [](unsigned seed) {
    image::Image image = randomImage(seed, 45, 45, 0.4f);
    for (size_t i = 0; i < image.values.size(); i += 3)
      image.values[i + 1] = image.values[i + 2] = image.values[i];
    return image;
  };
  const image::Image a = gray(7), b = gray(8);
  constexpr double pi = 3.14159265358979323846;
  struct Seen {
    double lightness, edge, point;
  };
  const auto plain = [&](const image::Image& image) {
    double light = 0, weight = 0;
    for (int y = -10; y <= 10; ++y)
      for (int x = -10; x <= 10; ++x) {
        const double w = std::exp(-pi * pi * (x * x + y * y) / (67. * 67.) / 0.0047);
        light += w * image.at(22 + x, 22 + y)[0];
        weight += w;
      }
    const double sigma = 0.5 * 0.082 * 67;
    double sums[2][2] = {}, positive[2] = {};
    for (int y = -9; y <= 9; ++y)
      for (int x = -9; x <= 9; ++x) {
        const double g = std::exp(-0.5 * (x * x + y * y) / (sigma * sigma));
        const double first = -x * g;
        positive[0] += std::max(first, 0.);
        sums[0][0] += first * image.at(22 + x, 22 + y)[0];
        sums[0][1] += first * image.at(22 + y, 22 + x)[0];
        positive[1] += std::max((x * x / (sigma * sigma) - 1) * g, 0.);
      }
    double negative = 0;
    for (int y = -9; y <= 9; ++y)
      for (int x = -9; x <= 9; ++x)
        negative +=
            std::max((1 - x * x / (sigma * sigma)) * std::exp(-0.5 * (x * x + y * y) / (sigma * sigma)), 0.);
    for (int y = -9; y <= 9; ++y)
      for (int x = -9; x <= 9; ++x) {
        double w = (x * x / (sigma * sigma) - 1) * std::exp(-0.5 * (x * x + y * y) / (sigma * sigma));
        w /= w > 0 ? positive[1] : negative;
        sums[1][0] += w * image.at(22 + x, 22 + y)[0];
        sums[1][1] += w * image.at(22 + y, 22 + x)[0];
      }
    return Seen{116 * std::cbrt(light / weight) - 16, std::hypot(sums[0][0], sums[0][1]) / positive[0],
                std::hypot(sums[1][0], sums[1][1])};
  };
  const Seen seenA = plain(a), seenB = plain(b);
  const double d = std::pow(std::abs(seenA.lightness - seenB.lightness), 0.7),
               edge = 0.4 * std::pow(203.3, 0.7);
  ASSERT_LT(d, edge);
  const double feature = std::sqrt(
      std::max(std::abs(seenA.edge - seenB.edge), std::abs(seenA.point - seenB.point)) / std::sqrt(2.));
  EXPECT_NEAR(flip(a, b).at(22, 22)[0], std::pow(0.95 * d / edge, 1 - feature), 1e-4);
}

TEST(Flip, MeanIsThatOfTheMask) {
  image::Image values(3, 1, 1);
  values.values = {0.5f, 1, 0.25f};
  image::Mask mask(3, 1);
  mask.inside = {1, 0, 1};
  EXPECT_EQ(meanOver(values, mask).mean(), 0.375);
}

TEST(Flip, LargerErrorsAreDrawnLighter) {
  float last = -1;
  for (int i = 0; i <= 20; ++i) {
    const Rgb color = errorColor(i / 20.);
    const float light = image::luma(
        {image::linearFromSrgb(color.r), image::linearFromSrgb(color.g), image::linearFromSrgb(color.b)});
    EXPECT_GT(light, last);
    last = light;
  }
}

} // namespace
} // namespace surflect::evaluation
