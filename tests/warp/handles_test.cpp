#include "warp/handles.h"

#include "surfel/base/error.h"
#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

namespace surflect::warp {
namespace {

std::vector<Vec3<double>> movedPoints(std::vector<Vec3<double>> points, const Warp& warp) {
  for (Vec3<double>& point : points) point = warp.position(point);
  return points;
}

TEST(Handles, GoExactlyToTheirTargets) {
  std::mt19937 random(1);
  for (const auto radius : {std::optional<double>(), std::optional(0.3), std::optional(3.0)})
    for (const size_t count : {1, 2, 3, 4, 5, 30, 200}) {
      const auto rest = randomPoints(count, random), targets = randomPoints(count, random);
      const WarpPointer warp = Handles(rest, radius).pullTo(targets);
      for (size_t i = 0; i < count; ++i)
        EXPECT_LT((warp->position(rest[i]) - targets[i]).norm(), 1e-9) << count;
    }
}

TEST(Handles, AtRestTheyMoveNothing) {
  std::mt19937 random(2);
  for (const auto radius : {std::optional<double>(), std::optional(1.0)}) {
    const auto rest = randomPoints(20, random);
    const WarpPointer warp = Handles(rest, radius).pullTo(rest);
    for (int i = 0; i < 100; ++i) {
      const Vec3<double> x = 3 * randomVector(random);
      EXPECT_LT((warp->position(x) - x).norm(), 1e-15);
      EXPECT_LT((*warp->jacobian(x) - Mat3<double>::Identity()).norm(), 1e-15);
    }
  }
}

TEST(Handles, MovedAffinelyTheyMoveAllSpaceSo) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 50; ++trial)
    for (const size_t count : {4, 7, 40}) {
      const auto rest = randomPoints(count, random);
      const WarpPointer affine = chainOf(randomScale(random), randomRigid(random));
      const WarpPointer warp = Handles(rest, std::nullopt).pullTo(movedPoints(rest, *affine));
      const Vec3<double> x = 2 * randomVector(random);
      EXPECT_LT((warp->position(x) - affine->position(x)).norm(), 2e-10) << count;
      EXPECT_LT((*warp->jacobian(x) - *affine->jacobian(x)).norm(), 2e-10) << count;
    }
}

TEST(Handles, FewerThanFourMoveSpaceByWhatTheySpan) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const Vec3<double> x = 2 * randomVector(random), shift = randomVector(random);
    for (const size_t count : {1, 2, 3}) {
      const auto rest = randomPoints(count, random);
      auto targets = rest;
      for (Vec3<double>& target : targets) target += shift;
      EXPECT_LT((Handles(rest, std::nullopt).pullTo(targets)->position(x) - x - shift).norm(), 1e-13);
    }
    // Three or more handles in a plane leave the direction across it unchanged.
    auto rest = randomPoints(3 + trial % 5, random);
    const Vec3<double> normal = (rest[1] - rest[0]).cross(rest[2] - rest[0]).normalized();
    for (Vec3<double>& r : rest) r -= normal.dot(r - rest[0]) * normal;
    const WarpPointer warp = Handles(rest, std::nullopt).pullTo(randomPoints(rest.size(), random));
    const Vec3<double> inPlane = x - normal.dot(x - rest[0]) * normal;
    EXPECT_LT((*warp->jacobian(inPlane) * normal - normal).norm(), 1e-9);
  }
}

TEST(Handles, WithARadiusSpaceBeyondItRests) {
  std::mt19937 random(5);
  const auto rest = randomPoints(10, random);
  const WarpPointer warp = Handles(rest, 0.4).pullTo(randomPoints(10, random));
  int far = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> x = 2 * randomVector(random);
    if (std::ranges::any_of(rest, [&](const Vec3<double>& r) { return (x - r).norm() < 0.4; })) continue;
    ++far;
    EXPECT_EQ(warp->position(x), x);
    EXPECT_EQ(*warp->jacobian(x), Mat3<double>::Identity());
  }
  EXPECT_GT(far, 500);
}

TEST(Handles, TheJacobianIsContinuousAtAHandle) {
  std::mt19937 random(6);
  for (const auto radius : {std::optional<double>(), std::optional(1.0)}) {
    const auto rest = randomPoints(10, random);
    const WarpPointer warp = Handles(rest, radius).pullTo(randomPoints(10, random));
    const Vec3<double> step = 1e-7 * randomUnit(random);
    for (const Vec3<double>& r : rest)
      EXPECT_LT((*warp->jacobian(r + step) - *warp->jacobian(r - step)).norm(), 1e-4);
  }
}

TEST(Handles, NoneOrTwoAtOnePlaceIsAnError) {
  EXPECT_THROW(Handles({}, std::nullopt), Error);
  for (const auto radius : {std::optional<double>(), std::optional(1.0)})
    EXPECT_THROW(Handles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1e-5, 0}}, radius), Error);
  EXPECT_THROW(Handles(std::vector<Vec3<double>>(mostHandles + 1), std::nullopt), Error);
}

} // namespace
} // namespace surflect::warp
