#include "render/stage/rig.h"

#include <gtest/gtest.h>

#include <numbers>

namespace surflect::stage {
namespace {

TEST(StageRig, ATurntableStepsRoundAtEachElevation) {
  const std::array elevations{Angle::fromDegrees(-30), Angle::fromDegrees(60)};
  const auto directions = turntable(8, elevations);
  ASSERT_EQ(directions.size(), 16u);
  for (size_t i = 0; i < directions.size(); ++i) {
    EXPECT_NEAR(directions[i].z(), i < 8 ? -0.5 : std::sqrt(0.75), 1e-12);
    EXPECT_NEAR(length(directions[i]), 1, 1e-12);
    const double azimuth = std::atan2(directions[i].y(), directions[i].x());
    EXPECT_NEAR(std::remainder(azimuth - static_cast<double>(i) * std::numbers::pi / 4, 2 * std::numbers::pi),
                0, 1e-12);
  }
}

TEST(StageRig, ASpiralIsEvenOverItsZone) {
  // Mean of x, y, z and of their squares over the sphere: 0 and 1/3.
  Vec3<double> mean = Vec3<double>::Zero(), squares = Vec3<double>::Zero();
  const auto sphere = spiral(500, -1, 1, Angle::fromDegrees(20));
  for (const auto& d : sphere) mean += d.raw() / 500, squares += d.raw().cwiseAbs2() / 500;
  EXPECT_LT(mean.norm(), 2e-3);
  EXPECT_LT((squares.array() - 1. / 3).abs().maxCoeff(), 2e-3);
  // The nearest neighbours of points that fill a sphere evenly are about sqrt(4 pi / n) apart.
  for (const auto& d : sphere) {
    double nearest = 2;
    for (const auto& other : sphere)
      if (!(other == d)) nearest = std::min(nearest, length(d + -other));
    EXPECT_GT(nearest, 0.7 * std::sqrt(4 * std::numbers::pi / 500));
  }
  for (const auto& d : spiral(50, -0.2, 0.6, Angle())) {
    EXPECT_GE(d.z(), -0.2);
    EXPECT_LE(d.z(), 0.6);
  }
}

TEST(StageRig, CamerasSeeTheCentreInTheMiddleAndStandUpright) {
  capture::Lens lens;
  lens.width = 40, lens.height = 30, lens.focalX = lens.focalY = 50, lens.centerX = 20, lens.centerY = 15;
  const Point3<AcquisitionSpace, double> center(1, 2, 3);
  auto directions = spiral(50, -1, 1, Angle());
  directions.push_back({0, 0, 1});
  directions.push_back({0, 0, -1});
  for (const auto& d : directions) {
    const auto camera = cameraAbout(center, d, 4, lens);
    const auto middle = camera.project(center);
    ASSERT_TRUE(middle);
    EXPECT_NEAR(middle->x, 20, 1e-9);
    EXPECT_NEAR(middle->y, 15, 1e-9);
    EXPECT_LT(length((center + 4.0 * d) - camera.center()), 1e-12);
    EXPECT_NEAR(camera.cameraFromWorld.rotation().determinant(), 1, 1e-12);
    if (std::abs(d.z()) < 1) {
      const auto above = camera.project(center + Direction3<AcquisitionSpace, double>(0, 0, 0.1));
      EXPECT_LT(above->y, 15);
      EXPECT_NEAR(above->x, 20, 1e-9);
    }
  }
}

} // namespace
} // namespace surflect::stage
