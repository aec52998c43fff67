#include "render/lightfield/spherical/reprojection.h"

#include "srf/image/half_float.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::spherical {
namespace {

constexpr int kSize = 16;

// Opaque image with a plateau in its left half and another in its right half.
PencilImage plateaus(Height left, Height right) {
  const uint16_t one = image::finiteHalf(1);
  std::vector<Height> heights;
  for (int texel = 0; texel < kSize * kSize; ++texel)
    heights.push_back(texel % kSize < kSize / 2 ? left : right);
  return mipmapped(kSize, std::vector<Texel>(heights.size(), {one, one, one, one}), heights);
}

struct Ray {
  Vec2<double> atPlane, slope;
};

// A ray that passes height h at a place.
Ray through(const Vec2<double>& place, double h, const Vec2<double>& slope) {
  return {place - h * slope, slope};
}

TEST(Reprojection, ARayMeetsAPlateauAtItsHeight) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> height(0, 65535);
  std::uniform_real_distribution<double> slope(-0.5, 0.5);
  for (int i = 0; i < 2000; ++i) {
    const Height low = static_cast<Height>(height(random)), high = static_cast<Height>(height(random));
    const PencilImage image = plateaus(low, high);
    const double left = static_cast<double>(image.mips[0].heights[0]);
    // Downwards in the middle of the left plateau, or so steep that the other one is not passed before it.
    const Ray ray = through({0.2, 0.5}, left, {-std::abs(slope(random)), slope(random)});
    const Ray down = through({0.2, 0.5}, left, {0, 0});
    if (low >= high) {
      const auto met = heightMet(image, ray.atPlane, ray.slope, 2, 0);
      ASSERT_TRUE(met) << low << ' ' << high;
      EXPECT_NEAR(*met, left, 1e-12);
    }
    const auto met = heightMet(image, down.atPlane, down.slope, 2, 0); // the lowest of all is met, too
    ASSERT_TRUE(met) << low << ' ' << high;
    EXPECT_NEAR(*met, left, 1e-12);
  }
}

TEST(Reprojection, NothingBehindTheViewerIsMet) {
  const PencilImage image = plateaus(20000, 60000);
  EXPECT_FALSE(heightMet(image, {0.8, 0.5}, {0, 0}, valueOf(50000), 0)); // inside of the right plateau
  EXPECT_FALSE(heightMet(image, {0.2, 0.5}, {0, 0}, valueOf(1000), 0));  // below all
  EXPECT_TRUE(heightMet(image, {0.2, 0.5}, {0, 0}, valueOf(50000), 0));
}

TEST(Reprojection, StepsAreAsLongAsTexelsWhateverTheHeights) {
  const Vec2<double> slope(0.6, 0.8);
  for (const float highest : {-0.25f, 0.f, 0.5f}) {
    const March march = marchOf({-0.5f, highest}, slope, 2, 32, 0);
    const double texels = 32 * (march.from - march.to) / march.steps;
    EXPECT_LE(texels, 1);
    EXPECT_GT(texels, 1 - 1.0 / march.steps);
  }
  EXPECT_EQ(marchOf({-0.5f, 0.5f}, slope, 2, 1024, 0).steps, kMostSteps);
}

} // namespace
} // namespace surflect::spherical
