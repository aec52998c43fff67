#include "surfel/geometry/ray_caster.h"

#include "tests/support/patience.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace surflect {
namespace {

using Position = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

// A square of side 2 around the z axis, in the plane z = 0, of 2 n^2 triangles.
TriangleMesh square(uint32_t n) {
  TriangleMesh mesh;
  const auto place = [n](uint32_t i) { return 2 * static_cast<float>(i) / static_cast<float>(n) - 1; };
  for (uint32_t y = 0; y <= n; ++y)
    for (uint32_t x = 0; x <= n; ++x) mesh.positions.emplace_back(place(x), place(y), 0.f);
  for (uint32_t y = 0; y < n; ++y)
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t a = y * (n + 1) + x, b = a + n + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  return mesh;
}

TEST(RayCaster, NothingIsHitInAnEmptyMesh) {
  const RayCaster<AcquisitionSpace> caster(TriangleMesh{});
  EXPECT_FALSE(caster.firstHit(Position(0, 0, 1), Direction(0, 0, -1)));
}

TEST(RayCaster, HitsWhereTheRayMeetsTheSquareAndNowhereElse) {
  const RayCaster<AcquisitionSpace> caster(square(7));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-2, 2);
  for (int i = 0; i < 1000; ++i) {
    const Position from(place(random), place(random), 1.5);
    const auto hit = caster.firstHit(from, Direction(0, 0, -1));
    ASSERT_EQ(hit.has_value(), std::abs(from.x()) < 1 && std::abs(from.y()) < 1);
    EXPECT_NEAR(hit ? hit->distance : 1.5, 1.5, 1e-6);
    EXPECT_FALSE(caster.firstHit(from, Direction(0, 0, 1)));
  }
}

TEST(RayCaster, RaysThatAreNotFiniteOrStartTooFarAwayMeetNothing) {
  const RayCaster<AcquisitionSpace> caster(square(2));
  const Direction down(0, 0, -1);
  const auto meetsNothing = [&](const Position& from, const Direction& direction) {
    return !caster.firstHit(from, direction) && !caster.occluded(from, direction, 0, 1e30) &&
           caster.winding(from, direction) == 0;
  };
  ASSERT_TRUE(caster.firstHit(Position(0.1, 0.2, 1e12), down));
  for (const double far : {1e19, 1e22, 1e38, 1e39, 1e200, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(meetsNothing(Position(0.1, 0.2, far), down)) << far;
    EXPECT_TRUE(meetsNothing(Position(-far, 0.2, 1), down)) << far;
    if (std::isfinite(far)) continue;
    EXPECT_TRUE(meetsNothing(Position(0.1, 0.2, 1), Direction(0, 0, -far))) << far;
  }
}

TEST(RayCaster, ALargeMeshIsGivenUpAtOnce) {
  const TriangleMesh mesh = square(700);
  Patience whole(std::numeric_limits<int>::max());
  const RayCaster<AcquisitionSpace> caster(mesh, whole.progress());
  EXPECT_TRUE(caster.firstHit(Position(0.3, 0.2, 1), Direction(0, 0, -1)));
  ASSERT_GE(whole.asks, 10);
  for (const int questions : {0, 1, whole.asks / 2}) {
    Patience impatient(questions);
    EXPECT_THROW(RayCaster<AcquisitionSpace>(mesh, impatient.progress()), Cancelled);
  }
}

} // namespace
} // namespace surflect
