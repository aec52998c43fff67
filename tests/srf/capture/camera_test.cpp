#include "srf/capture/camera.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::capture {
namespace {

using CameraPoint = Point3<CameraSpace, double>;

class CameraTest : public ::testing::Test {
protected:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  // A lens like calibrated ones: the picture reaches about 40 degrees off the axis, with a distortion of some
  // percent.
  Lens distortedLens() {
    return {Lens::Model::pinhole,
            640,
            480,
            uniform(450, 550),
            uniform(450, 550),
            uniform(300, 340),
            uniform(220, 260),
            uniform(-0.15, 0.15),
            uniform(-0.02, 0.02),
            uniform(-0.01, 0.01),
            uniform(-0.01, 0.01),
            uniform(-0.005, 0.005)};
  }
  Pixel anyPixel(const Lens& lens) { return {uniform(0, lens.width), uniform(0, lens.height)}; }
  Rigid<CameraSpace, AcquisitionSpace> anyPose() {
    const Eigen::Quaterniond q(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    return {q.normalized().toRotationMatrix(), {uniform(-5, 5), uniform(-5, 5), uniform(-5, 5)}};
  }

  std::mt19937 random_{1};
};

TEST_F(CameraTest, PointsOnTheRayThroughAPixelProjectToIt) {
  for (int i = 0; i < 2000; ++i) {
    const Lens lens = distortedLens();
    const Pixel pixel = anyPixel(lens);
    const auto ray = rayThrough(lens, pixel);
    ASSERT_TRUE(ray);
    EXPECT_NEAR(length(ray->direction), 1, 4e-16);
    const auto back = project(lens, ray->origin + uniform(0.1, 100) * ray->direction);
    ASSERT_TRUE(back);
    EXPECT_NEAR(back->x, pixel.x, 4.5e-13);
    EXPECT_NEAR(back->y, pixel.y, 4.5e-13);
  }
}

TEST_F(CameraTest, UndistortIsTheInverseOfDistort) {
  for (int i = 0; i < 2000; ++i) {
    const Lens lens = distortedLens();
    const Vec2<double> q(uniform(-0.7, 0.7), uniform(-0.5, 0.5));
    const auto back = undistort(lens, distort(lens, q));
    ASSERT_TRUE(back);
    EXPECT_NEAR((*back - q).norm(), 0, 7e-16);
  }
}

TEST_F(CameraTest, WithoutDistortionProjectionIsSimilarity) {
  const Lens lens{Lens::Model::pinhole, 640, 480, 500, 400, 320, 240};
  for (int i = 0; i < 100; ++i) {
    const CameraPoint p(uniform(-1, 1), uniform(-1, 1), uniform(-9, -1));
    const auto pixel = project(lens, p);
    EXPECT_NEAR(pixel->x, 320 + 500 * p.x() / -p.z(), 1e-12);
    EXPECT_NEAR(pixel->y, 240 - 400 * p.y() / -p.z(), 1e-12); // up in space is a smaller row
  }
}

TEST_F(CameraTest, NothingBehindAPinholeIsInThePicture) {
  const Lens lens = distortedLens();
  EXPECT_FALSE(project(lens, {0.1, 0.1, 0}));
  EXPECT_FALSE(project(lens, {0.1, 0.1, 1}));
  EXPECT_TRUE(project(lens, {0.1, 0.1, -1}));
}

TEST_F(CameraTest, AProjectorSaysWhatTheCameraDoes) {
  for (int i = 0; i < 600; ++i) {
    Camera<AcquisitionSpace> camera{distortedLens(), anyPose()};
    if (i % 3 > 0) camera.lens.k1 = camera.lens.k2 = camera.lens.k3 = camera.lens.p1 = camera.lens.p2 = 0;
    if (i % 3 > 1) camera.lens.model = Lens::Model::orthographic;
    const Projector<AcquisitionSpace> project(camera);
    for (int j = 0; j < 20; ++j) {
      const Point3<AcquisitionSpace, double> p(uniform(-9, 9), uniform(-9, 9), uniform(-9, 9));
      const auto expected = camera.project(p), got = project(p);
      ASSERT_EQ(got.has_value(), expected.has_value());
      if (!got) continue;
      const double size = std::max({640., std::abs(expected->x), std::abs(expected->y)});
      EXPECT_NEAR(got->x, expected->x, 1e-11 * size);
      EXPECT_NEAR(got->y, expected->y, 1e-11 * size);
    }
  }
}

// x (1 - 0.3 x^2) has its maximum at x = 1.054 and comes back to 0 at 1.826.
TEST_F(CameraTest, PointsBeyondTheFoldOfTheDistortionAreNotInThePicture) {
  Lens lens{Lens::Model::pinhole, 640, 480, 500, 500, 320, 240};
  lens.k1 = -0.3;
  EXPECT_TRUE(project(lens, {1.05, 0, -1}));
  for (double x = 1.06; x < 20; x *= 1.1) EXPECT_FALSE(project(lens, {x, 0, -1})) << x;
  EXPECT_FALSE(undistort(lens, {0.71, 0})); // the maximum is 0.703
  lens.k2 = 0.03; // the polynomial turns down at 1.27 and up again at 1.57: the second rise is a fold too
  EXPECT_TRUE(project(lens, {1.2, 0, -1}));
  for (double x = 1.3; x < 20; x *= 1.1) EXPECT_FALSE(project(lens, {x, 0, -1})) << x;
  lens.k2 = 0.1; // never turns
  for (double x = 1.3; x < 20; x *= 1.1) EXPECT_TRUE(project(lens, {x, 0, -1})) << x;
}

// The first zero of d/dr (r + k1 r^3 + k2 r^5 + k3 r^7), found in small steps, is the fold.
TEST_F(CameraTest, TheFoldOfThreeRadialTermsIsWhereTheyFirstTurn) {
  for (int i = 0; i < 300; ++i) {
    Lens lens{Lens::Model::pinhole, 640, 480, 500, 500, 320, 240};
    lens.k1 = uniform(-0.5, 0.5), lens.k2 = uniform(-0.3, 0.3), lens.k3 = uniform(-0.1, 0.1);
    bool hasTurned = false;
    for (double r = 0; r < 3; r += 1e-3) {
      const double r2 = r * r,
                   slope = 1 + 3 * lens.k1 * r2 + 5 * lens.k2 * r2 * r2 + 7 * lens.k3 * r2 * r2 * r2;
      hasTurned |= slope <= 0;
      if (std::abs(slope) > 0.01) {
        ASSERT_EQ(project(lens, {r, 0, -1}).has_value(), !hasTurned) << r;
      }
    }
  }
}

TEST_F(CameraTest, OrthographicRaysAreParallelAndKeepTheirPixel) {
  const Lens lens{Lens::Model::orthographic, 640, 480, 100, 100, 320, 240};
  for (int i = 0; i < 100; ++i) {
    const Pixel pixel = anyPixel(lens);
    const auto ray = rayThrough(lens, pixel);
    EXPECT_EQ(ray->direction, (Direction3<CameraSpace, double>(0, 0, -1)));
    const auto back = project(lens, ray->origin + uniform(-10, 10) * ray->direction);
    EXPECT_NEAR(back->x, pixel.x, 1e-12);
    EXPECT_NEAR(back->y, pixel.y, 1e-12);
  }
}

TEST_F(CameraTest, DirectionTowardsTheViewerIsTheReversedRay) {
  for (int i = 0; i < 200; ++i) {
    Camera<AcquisitionSpace> camera{distortedLens(), anyPose()};
    if (i % 2) camera.lens = {Lens::Model::orthographic, 640, 480, 100, 100, 320, 240};
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    const auto ray = rayThrough(camera.lens, anyPixel(camera.lens));
    const auto p = worldFromCamera(ray->origin + uniform(1, 10) * ray->direction);
    EXPECT_NEAR(length(Viewpoint(camera).towards(p) + worldFromCamera(ray->direction)), 0, 1e-14);
    EXPECT_TRUE(camera.project(p) && contains(camera.lens, *camera.project(p)));
  }
}

TEST_F(CameraTest, APictureContainsItsFirstEdgesOnly) {
  const Lens lens{Lens::Model::pinhole, 4, 3, 1, 1, 2, 1.5};
  EXPECT_TRUE(contains(lens, {0, 0}));
  EXPECT_TRUE(contains(lens, {3.999, 2.999}));
  EXPECT_FALSE(contains(lens, {4, 1}));
  EXPECT_FALSE(contains(lens, {1, 3}));
  EXPECT_FALSE(contains(lens, {-1e-9, 1}));
}

TEST(Lens, ResizedSeesTheSameWithPixelsScaled) {
  const Lens lens{
      .width = 640, .height = 480, .focalX = 700, .focalY = 710, .centerX = 301, .centerY = 244, .k1 = 0.1};
  const Lens half = resized(lens, 320, 120);
  const Point3<CameraSpace, double> p(0.2, -0.15, -1.3);
  EXPECT_NEAR(project(half, p)->x, project(lens, p)->x / 2, 1e-12);
  EXPECT_NEAR(project(half, p)->y, project(lens, p)->y / 4, 1e-12);
}

} // namespace
} // namespace surflect::capture
