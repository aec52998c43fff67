#include "surfel/geometry/splat_caster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace surflect {
namespace {

using ObjectPosition = Point3<ObjectSpace, double>;
using ObjectDirection = Direction3<ObjectSpace, double>;
constexpr double kFar = std::numeric_limits<double>::infinity();
const ObjectDirection kUp(0, 0, 1);

// A splat at z = 1 whose kernel ends on an ellipse with half-axes 4 and 2.
SplatCaster<ObjectSpace> oneSplat() {
  return SplatCaster<ObjectSpace>({{{0, 0, 1}, {4, 0, 0}, {0, 2, 0}, 1}});
}

TEST(SplatCaster, BlocksByTheKernelOfItsEllipse) {
  const auto caster = oneSplat();
  for (const auto& [x, y] :
       {std::pair{0.0, 0.0}, {1.6, 0.0}, {2.0, 0.5}, {0.0, 0.8}, {2.4, 0.9}, {3.5, 0.5}}) {
    const double rest = 1 - x * x / 16 - y * y / 4;
    const double expected = std::clamp(4 * rest * rest - 0.5, 0.0, 1.0);
    EXPECT_NEAR(caster.blocked(ObjectPosition(x, y, 0), kUp, 0, kFar), expected, 3e-6) << x << ' ' << y;
    EXPECT_NEAR(caster.blocked(ObjectPosition(x, y, 3), ObjectDirection(0, 0, -1), 0, kFar), expected, 3e-6);
  }
  EXPECT_EQ(caster.blocked(ObjectPosition(3.9, 1.9, 0), kUp, 0, kFar), 0); // in its box alone
  EXPECT_EQ(caster.blocked(ObjectPosition(0, 0, 3), kUp, 0, kFar), 0);
}

TEST(SplatCaster, SumsTheSplatsThatARayMeetsInAnyOrder) {
  const OpaqueSplat<ObjectSpace> low{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 0.15f},
      high{{0, 0, 2}, {1, 0, 0}, {0, 1, 0}, 0.1f};
  const SplatCaster<ObjectSpace> one({low, high}), other({high, low});
  EXPECT_NEAR(one.blocked(ObjectPosition(0, 0, 0), kUp, 0, kFar), 0.5, 3e-6);
  for (const double x : {0.0, 0.1, 0.2, 0.3})
    EXPECT_EQ(one.blocked(ObjectPosition(x, 0, 0), kUp, 0, kFar),
              other.blocked(ObjectPosition(x, 0, 0), kUp, 0, kFar));
}

TEST(SplatCaster, OnlyTheGivenPartOfTheRayCounts) {
  const auto caster = oneSplat();
  EXPECT_EQ(caster.blocked(ObjectPosition(0, 0, 0), kUp, 1.1, kFar), 0);
  EXPECT_EQ(caster.blocked(ObjectPosition(0, 0, 0), kUp, 0, 0.9), 0);
  EXPECT_EQ(caster.blocked(ObjectPosition(0, 0, 0), kUp, 0.9, 1.1), 1);
}

TEST(SplatCaster, ARayThatIsNotFiniteMeetsNothing) {
  const auto caster = oneSplat();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(caster.blocked(ObjectPosition(nan, 0, 0), kUp, 0, kFar), 0);
  EXPECT_EQ(caster.blocked(ObjectPosition(0, 0, 0), ObjectDirection(0, 0, nan), 0, kFar), 0);
}

TEST(SplatCaster, WithoutSplatsNothingIsInTheWay) {
  const SplatCaster<ObjectSpace> caster({});
  EXPECT_EQ(caster.blocked(ObjectPosition(0, 0, 0), kUp, 0, kFar), 0);
}

} // namespace
} // namespace surflect
