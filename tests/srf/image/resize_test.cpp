#include "srf/image/resize.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace surflect::image {
namespace {

Image randomImage(int width, int height, int channels, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-0.1f, 1);
  Image image(width, height, channels);
  for (float& value : image.values) value = uniform(random);
  return image;
}

double meanOf(const Image& image, const PixelWindow& window, size_t channel) {
  double sum = 0;
  for (int y = window.y0; y < window.y1; ++y)
    for (int x = window.x0; x < window.x1; ++x) sum += image.at(x, y)[channel];
  return sum / (window.width() * window.height());
}

TEST(Resize, TheWindowAtItsOwnSizeIsACopy) {
  const Image image = randomImage(13, 9, 3, 1);
  const PixelWindow window{2, 1, 11, 8};
  const Image copy = resampled(image, window, window.width(), window.height());
  for (int y = 0; y < copy.height; ++y)
    for (int x = 0; x < copy.width; ++x)
      for (size_t c = 0; c < 3; ++c) EXPECT_EQ(copy.at(x, y)[c], image.at(x + 2, y + 1)[c]);
}

TEST(Resize, AnyOtherSizeKeepsTheMean) {
  const Image image = randomImage(31, 17, 2, 2);
  const PixelWindow window{3, 2, 30, 17};
  const PixelWindow sizes[] = {{0, 0, 1, 1}, {0, 0, 5, 4}, {0, 0, 26, 14}, {0, 0, 28, 16}, {0, 0, 80, 100}};
  for (const PixelWindow& size : sizes) {
    const Image other = resampled(image, window, size.width(), size.height());
    for (const size_t c : {0u, 1u}) EXPECT_NEAR(meanOf(other, size, c), meanOf(image, window, c), 2e-6);
  }
}

TEST(Resize, MagnifiedPixelsAreSquaresOfTheirColour) {
  const Image image = randomImage(4, 3, 1, 3);
  const Image large = resampled(image, {0, 0, 4, 3}, 12, 15);
  for (int y = 0; y < large.height; ++y)
    for (int x = 0; x < large.width; ++x)
      EXPECT_FLOAT_EQ(large.at(x, y)[0], image.at(x / 3, y / 5)[0]) << x << ' ' << y;
}

TEST(Resize, AStepIsSharedByAreaBetweenTheSidesOfAPixel) {
  Image image(10, 1, 1);
  for (int x = 4; x < 10; ++x) image.at(x, 0)[0] = 1;
  const Image third = resampled(image, {0, 0, 10, 1}, 3, 1); // 4 of 10 falls at 1.2 of 3
  EXPECT_NEAR(third.at(0, 0)[0], 0, 1e-6);
  EXPECT_NEAR(third.at(1, 0)[0], 0.8, 1e-6);
  EXPECT_NEAR(third.at(2, 0)[0], 1, 1e-6);
}

TEST(Resize, MeansOfEqualSquaresAreExact) {
  for (int side = 1; side <= 8; ++side) {
    Image image(2 * side + 1, side, 1);
    for (int y = 0; y < side; ++y)
      for (int x = 0; x <= 2 * side; ++x) image.at(x, y)[0] = x < side ? 1.f : 0.25f;
    const Image means = squareMeans(image, side);
    EXPECT_EQ(means.values,
              side == 1 ? std::vector<float>({1, 0.25f, 0.25f}) : std::vector<float>({1, 0.25f}));
  }
}

TEST(Resize, MinimaOfSquaresAreTheirLeastValues) {
  Image image(5, 4, 1);
  for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = static_cast<float>((7 * i + 3) % 20);
  EXPECT_EQ(squareMinima(image, 1).values, image.values);
  const Image minima = squareMinima(image, 2);
  ASSERT_EQ(minima.width, 2);
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 2; ++x)
      EXPECT_EQ(minima.at(x, y)[0],
                std::min({image.at(2 * x, 2 * y)[0], image.at(2 * x + 1, 2 * y)[0],
                          image.at(2 * x, 2 * y + 1)[0], image.at(2 * x + 1, 2 * y + 1)[0]}));
}

} // namespace
} // namespace surflect::image
