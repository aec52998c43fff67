#include "surfel/geometry/ray_caster.h"

#include <gtest/gtest.h>

#include <limits>

namespace surflect {
namespace {

using ObjectPosition = Point3<ObjectSpace, double>;
using ObjectDirection = Direction3<ObjectSpace, double>;
constexpr double kFar = std::numeric_limits<double>::infinity();

// A disc of radius 2 at z = 1.
DiscCaster<ObjectSpace> oneDisc() { return {{{0, 0, 1}}, {{0, 0, 1}}, {2.f}}; }

TEST(DiscCaster, ADiscIsInTheWayWithinItsRadius) {
  const auto caster = oneDisc();
  const ObjectDirection up(0, 0, 1);
  EXPECT_TRUE(caster.occluded(ObjectPosition(1.9, 0, 0), up, 0, kFar));
  EXPECT_FALSE(caster.occluded(ObjectPosition(2.1, 0, 0), up, 0, kFar));
  EXPECT_TRUE(caster.occluded(ObjectPosition(0, 0, 3), ObjectDirection(0, 0, -1), 0, kFar)); // both sides
  EXPECT_FALSE(caster.occluded(ObjectPosition(0, 0, 3), up, 0, kFar));
}

TEST(DiscCaster, OnlyTheGivenPartOfTheRayCounts) {
  const auto caster = oneDisc();
  const ObjectDirection up(0, 0, 1);
  EXPECT_FALSE(caster.occluded(ObjectPosition(0, 0, 0), up, 1.1, kFar));
  EXPECT_FALSE(caster.occluded(ObjectPosition(0, 0, 0), up, 0, 0.9));
  EXPECT_TRUE(caster.occluded(ObjectPosition(0, 0, 0), up, 0.9, 1.1));
}

TEST(DiscCaster, ARayThatIsNotFiniteMeetsNothing) {
  const auto caster = oneDisc();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(caster.occluded(ObjectPosition(nan, 0, 0), ObjectDirection(0, 0, 1), 0, kFar));
  EXPECT_FALSE(caster.occluded(ObjectPosition(0, 0, 0), ObjectDirection(0, 0, nan), 0, kFar));
}

TEST(DiscCaster, WithoutDiscsNothingIsInTheWay) {
  const DiscCaster<ObjectSpace> caster({}, {}, {});
  EXPECT_FALSE(caster.occluded(ObjectPosition(0, 0, 0), ObjectDirection(0, 0, 1), 0, kFar));
}

} // namespace
} // namespace surflect
