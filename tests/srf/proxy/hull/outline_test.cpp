#include "srf/proxy/hull/outline.h"

#include "tests/srf/image/files.h"

#include <cmath>
#include <random>

namespace surflect::hull {
namespace {

// The share of each pixel, by 16 x 16 samples, in which inside(x, y).
template <class Inside> image::Image covered(int width, int height, const Inside& inside) {
  image::Image alpha(width, height, 1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int s = 0; s < 256; ++s)
        alpha.at(x, y)[0] += inside(x + (s % 16 + 0.5) / 16, y + (s / 16 + 0.5) / 16) ? 1 / 256.f : 0;
  return alpha;
}

// Error of bilinear interpolation for an edge seen through a square pixel, largest if one pixel is covered
// and the next to 0.3; and samples of a sixteenth.
constexpr double kTolerance = 0.086 + 1 / 32.0;

TEST(Outline, OfAHalfPlaneIsItsDistanceAtAnyAngle) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 20; ++round) {
    const double angle = 2 * M_PI * unit(random), offset = 4 * unit(random) - 2;
    const auto distance = [&](double x, double y) {
      return (x - 16) * std::cos(angle) + (y - 12) * std::sin(angle) - offset;
    };
    const Outline outline(covered(32, 24, [&](double x, double y) { return distance(x, y) > 0; }));
    for (int i = 0; i < 200; ++i) {
      // Away from the border, beyond which the line goes on and the outline does not.
      const double x = 10 + 12 * unit(random), y = 8 + 8 * unit(random);
      EXPECT_NEAR(outline.signedDistance({x, y}), distance(x, y), kTolerance) << angle;
    }
  }
}

TEST(Outline, OfADiscIsItsDistance) {
  const auto distance = [](double x, double y) { return 11.3 - std::hypot(x - 20.2, y - 17.9); };
  const Outline outline(covered(40, 36, [&](double x, double y) { return distance(x, y) > 0; }));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> x(0.5, 39.5), y(0.5, 35.5);
  for (int i = 0; i < 2000; ++i) {
    const capture::Pixel pixel{x(random), y(random)};
    if (distance(pixel.x, pixel.y) > 6) continue; // bilinear cuts off the tip: 1 / (4 * 5.3) here
    EXPECT_NEAR(outline.signedDistance(pixel), distance(pixel.x, pixel.y), kTolerance + 0.05);
  }
  EXPECT_NEAR(outline.centroid().x, 20.2, 0.15);
  EXPECT_NEAR(outline.centroid().y, 17.9, 0.15);
}

TEST(Outline, MaskAndSignAreThoseOfAlphaAboveOneHalf) {
  const image::Image alpha = image::randomImage(33, 21, 1, 0, 1, 3);
  const Outline outline(alpha);
  EXPECT_EQ(outline.mask(), image::objectMask(alpha));
  for (int y = 0; y < alpha.height; ++y)
    for (int x = 0; x < alpha.width; ++x)
      EXPECT_EQ(outline.signedDistance({x + 0.5, y + 0.5}) > 0, alpha.at(x, y)[0] > 0.5f);
}

TEST(Outline, TheBorderOfTheImageIsNone) {
  // The object leaves the picture on the left.
  const Outline outline(covered(30, 10, [](double x, double) { return x < 20; }));
  for (const double x : {0.0, 0.5, 5.0, 19.0})
    EXPECT_NEAR(outline.signedDistance({x, 0.2}), 20 - std::max(x, 0.5), 1e-4);

  EXPECT_TRUE(outline.isCropped());
  EXPECT_FALSE(Outline(covered(9, 9, [](double x, double y) {
                 return std::hypot(x - 4.5, y - 4.5) < 3;
               })).isCropped());

  image::Image full(7, 5, 1);
  std::ranges::fill(full.values, 1.f);
  EXPECT_FALSE(Outline(full).isEmpty());
  EXPECT_EQ(Outline(full).signedDistance({0, 0}), 12);
  EXPECT_TRUE(Outline(image::Image(7, 5, 1)).isEmpty());
  EXPECT_EQ(Outline(image::Image(7, 5, 1)).signedDistance({3, 3}), -12);
}

TEST(Outline, ASinglePixelOrRowOfThemIsAnImageToo) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 4}, {4, 1}}) {
    image::Image alpha(width, height, 1);
    alpha.values[0] = 1;
    EXPECT_GT(Outline(alpha).signedDistance({0.5, 0.5}), 0);
  }
}

} // namespace
} // namespace surflect::hull
