#include "render/film/blur_samples.h"

#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace surflect::film {
namespace {

capture::Camera<ObjectSpace> someCamera() {
  capture::Camera<ObjectSpace> camera;
  camera.lens = {.width = 400, .height = 300, .focalX = 500, .focalY = 520, .centerX = 190, .centerY = 160};
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.8, 0.1, -0.3, 0.5).normalized();
  camera.cameraFromWorld = {turn.toRotationMatrix(), Vec3<double>(0.2, -0.4, -3)};
  return camera;
}

TEST(BlurSamples, TimesAreTheMiddlesOfEqualPartsOfTheShutter) {
  for (const int n : {1, 2, 7, 16, 1000})
    for (int i = 0; i < n; ++i) EXPECT_NEAR(blurSample(i, n).time, -0.5 + (2 * i + 1) / (2.0 * n), 1e-15);
}

TEST(BlurSamples, OneAloneIsTheMiddleOfShutterAndLens) {
  const BlurSample sample = blurSample(0, 1);
  EXPECT_EQ(sample.time, 0);
  EXPECT_EQ(sample.lens, Vec2<double>(0, 0));
}

TEST(BlurSamples, LensPointsAreEvenOverTheDiscAndOverTime) {
  for (const auto& [n, bound] : {std::pair{16, 0.08}, {64, 0.03}, {1024, 0.003}}) {
    Vec2<double> mean(0, 0), withTime(0, 0);
    double square = 0;
    for (int i = 0; i < n; ++i) {
      const BlurSample sample = blurSample(i, n);
      EXPECT_LE(sample.lens.norm(), 1);
      mean += sample.lens / n;
      square += sample.lens.squaredNorm() / n;
      withTime += sample.time * sample.lens / n;
    }
    EXPECT_LT(mean.norm(), bound) << n;
    EXPECT_NEAR(square, 0.5, bound) << n; // of a disc of radius 1
    EXPECT_LT(withTime.norm(), bound) << n;
  }
}

TEST(OnDisc, EqualAreasStayEqual) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.01, 0.99);
  constexpr double step = 1e-6;
  for (int i = 0; i < 200; ++i) {
    const Vec2<double> at(uniform(random), uniform(random)), from = 2 * at - Vec2<double>(1, 1);
    if (std::abs(std::abs(from[0]) - std::abs(from[1])) < 1e-3) continue; // the map bends on the diagonals
    const Vec2<double> x(step, 0), y(0, step);
    const Vec2<double> dx = (onDisc(at + x) - onDisc(at - x)) / (2 * step),
                       dy = (onDisc(at + y) - onDisc(at - y)) / (2 * step);
    EXPECT_NEAR(dx[0] * dy[1] - dx[1] * dy[0], std::numbers::pi, 1e-7);
  }
}

// A point at distance F stays; one at depth z moves by f a (1/F - 1/z) for the lens point a.
TEST(LensPoint, PointsInFocusStayAndOthersMoveByTheThinLens) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const capture::Camera<ObjectSpace> camera = someCamera();
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  for (int i = 0; i < 100; ++i) {
    const double focus = 2 + uniform(random), depth = i % 2 ? focus : 3 + 2 * uniform(random);
    const Vec2<double> offset(0.2 * uniform(random), 0.2 * uniform(random));
    const auto p = worldFromCamera(Point3<CameraSpace, double>(uniform(random), uniform(random), -depth));
    const auto before = camera.project(p), after = throughLensPoint(camera, offset, focus).project(p);
    ASSERT_TRUE(before && after);
    const Vec2<double> moved = offset * (1 / focus - 1 / depth);
    EXPECT_NEAR(after->x - before->x, camera.lens.focalX * moved[0], 1e-10);
    EXPECT_NEAR(after->y - before->y, -camera.lens.focalY * moved[1], 1e-10);
  }
}

TEST(LensPoint, TheRimOfTheLensDrawsTheCircleOfConfusion) {
  const capture::Camera<ObjectSpace> camera = someCamera();
  const auto p = camera.cameraFromWorld.inverse()(Point3<CameraSpace, double>(0.1, 0.2, -5));
  const auto left = throughLensPoint(camera, {-0.15, 0}, 2).project(p),
             right = throughLensPoint(camera, {0.15, 0}, 2).project(p);
  EXPECT_NEAR(std::abs(right->x - left->x), circleOfConfusion(0.3, camera.lens.focalX, 2, 5), 1e-10);
  EXPECT_EQ(circleOfConfusion(0.3, camera.lens.focalX, 2, 2), 0);
}

TEST(LensPoint, LensesThatAreNoPinholeAreRefused) {
  capture::Camera<ObjectSpace> distorting = someCamera(), orthographic = someCamera();
  distorting.lens.k1 = 0.1;
  orthographic.lens.model = capture::Lens::Model::orthographic;
  EXPECT_EQ(image::errorOf([&] {
              throughLensPoint(distorting, {0.1, 0}, 2);
            }),
            "aperture: found more, expected 0 for a captured camera whose lens distorts");
  EXPECT_EQ(image::errorOf([&] {
              throughLensPoint(orthographic, {0.1, 0}, 2);
            }),
            "aperture: found more, expected 0 for an orthographic camera, in which all is sharp");
  EXPECT_EQ(image::errorOf([&] {
              throughLensPoint(someCamera(), {0, 1e5}, 2);
            }),
            "aperture: found a lens point 100000 from the axis, expected a smaller lens for a focus at 2");
}

} // namespace
} // namespace surflect::film
