#include "surfel/math/sphere_sampling.h"

#include <gtest/gtest.h>

namespace surflect {
namespace {

TEST(FibonacciSphere, DirectionsAreUnitVectorsWithinTheZone) {
  for (const Vec3<double>& d : fibonacciSphere(100, -0.3, 0.8)) {
    EXPECT_NEAR(d.norm(), 1, 1e-15);
    EXPECT_GT(d.z(), -0.3);
    EXPECT_LT(d.z(), 0.8);
  }
}

// The share of directions in a cap of the sphere is the cap's share of the area, (1 - cos) / 2.
TEST(FibonacciSphere, CapsHoldTheirShareOfTheDirections) {
  const auto directions = fibonacciSphere(2000);
  for (const Vec3<double>& axis : fibonacciSphere(13))
    for (const double cosine : {0.0, 0.5, 0.9}) {
      double inside = 0;
      for (const Vec3<double>& d : directions) inside += d.dot(axis) > cosine;
      EXPECT_NEAR(inside / 2000, (1 - cosine) / 2, 0.006) << axis.transpose() << ' ' << cosine;
    }
}

TEST(FibonacciSphere, TheStartTurnsAllDirections) {
  const Angle start = Angle::fromDegrees(30);
  const Mat3<double> turn =
      Eigen::AngleAxis<double>(start.radians(), Vec3<double>::UnitZ()).toRotationMatrix();
  const auto from0 = fibonacciSphere(20), from30 = fibonacciSphere(20, -1, 1, start);
  for (size_t i = 0; i < 20; ++i) EXPECT_LT((turn * from0[i] - from30[i]).norm(), 1e-14);
}

} // namespace
} // namespace surflect
