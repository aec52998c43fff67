#include "render/lightfield/spherical/reprojection.h"

#include "srf/image/half_float.h"

#include <gtest/gtest.h>

#include <cmath>
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

TEST(Reprojection, ALinePassesAHeightWhereItsSlopeTells) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1), up(0.5, 3);
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> e(any(random), any(random), up(random)), w(any(random), any(random), -up(random));
    const double height = any(random), distance = (height - e[2]) / w[2];
    const Vec2<double> place = atPlane(e, w) + height * slopeOf(w);
    EXPECT_LT((place - (e + distance * w).head<2>()).norm(), 1e-12);
  }
}

TEST(Reprojection, APointIsVisibleWhereNoHeightIsInFrontOfIt) {
  const PencilImage image = plateaus(20000, 60000);
  const double low = valueOf(20000);
  for (const double mip : {0., 1.}) {
    const double texel = std::exp2(mip) / kSize;
    const auto visibilityAt = [&](double height) { return visibility(image, {0.2, 0.5, height}, mip); };
    for (const double height : {low - 1.9 * texel, low, low + 0.1}) EXPECT_EQ(visibilityAt(height), 1);
    EXPECT_NEAR(visibilityAt(low - 3 * texel), 0.5, 1e-6);
    EXPECT_EQ(visibilityAt(low - 4.1 * texel), 0);
    EXPECT_EQ(visibility(image, {0.8, 0.5, low}, mip), 0); // under the right plateau
  }
}

TEST(Reprojection, OpaqueTexelsCountWhollyAndOutlinesLess) {
  EXPECT_EQ(weightOfAlpha(1), 1);
  for (const double alpha : {0., 0.25, 0.5}) EXPECT_EQ(weightOfAlpha(alpha), 0);
  double before = 0;
  for (const double alpha : {0.6, 0.7, 0.8, 0.9, 1.}) {
    EXPECT_GT(weightOfAlpha(alpha), before);
    before = weightOfAlpha(alpha);
  }
}

} // namespace
} // namespace surflect::spherical
