#include "render/splat/splat.h"

#include "tests/render/clouds.h"

#include <gtest/gtest.h>

namespace surflect::splat {
namespace {

using namespace testing;
using V3 = Vec3<double>;

struct Disc {
  Point3<CameraSpace, double> p;
  Direction3<CameraSpace, double> u, v;

  Point3<CameraSpace, double> at(double a, double b) const {
    return assume<Point3<CameraSpace, double>>(p.raw() + a * u.raw() + b * v.raw());
  }
  V3 normal() const { return u.raw().cross(v.raw()); }
};

// A sheared, stretched disc of about unit size in front of the camera, not fully edge-on.
Disc randomDisc(Rng& rng, double depth) {
  Disc disc;
  do {
    disc.p = assume<Point3<CameraSpace, double>>(V3(0, 0, -depth) + randomVector(rng, 0.4 * depth));
    disc.u = assume<Direction3<CameraSpace, double>>(randomVector(rng, 1));
    disc.v = assume<Direction3<CameraSpace, double>>(randomVector(rng, 1));
  } while (std::abs(disc.normal().dot(disc.p.raw())) < 0.2 * disc.p.raw().norm());
  return disc;
}

capture::Lens pinhole(int width = 640, int height = 480, double focal = 700) {
  return lookAt({0, 0, 1}, {0, 0, 0}, width, height, focal).lens;
}

// Largest |d^T V^-1 d - 1| over the images of points of the circle, where d is the offset from the ellipse's
// centre.
double contourError(const capture::Lens& lens, const Disc& disc, double s) {
  const ScreenGaussian gaussian = project(lens, disc.p, disc.u, disc.v, s);
  const Eigen::Matrix2d inverse = gaussian.covariance.topLeftCorner<2, 2>().inverse();
  double worst = 0;
  for (int i = 0; i < 12; ++i) {
    const double angle = i * std::numbers::pi / 6;
    const auto pixel = project(lens, disc.at(s * std::cos(angle), s * std::sin(angle)));
    const Vec2<double> d = Vec2<double>(pixel->x, pixel->y) - gaussian.mean.head<2>();
    worst = std::max(worst, std::abs(d.dot(inverse * d) - 1));
  }
  return worst;
}

TEST(Splat, ItsEllipseIsTheExactPerspectiveImageOfTheCircle) {
  Rng rng(1);
  for (int trial = 0; trial < 200; ++trial) EXPECT_LT(contourError(pinhole(), randomDisc(rng, 10), 1), 3e-14);
}

TEST(Splat, ItsEllipseFollowsLensDistortionToFirstOrder) {
  Rng rng(2);
  capture::Lens lens = pinhole();
  lens.k1 = -0.15, lens.k2 = 0.05, lens.p1 = 0.01, lens.p2 = -0.02;
  for (int trial = 0; trial < 200; ++trial) {
    const Disc disc = randomDisc(rng, 10);
    EXPECT_LT(contourError(lens, disc, 1e-3), 3e-4);
    EXPECT_LT(contourError(lens, disc, 1e-5), 3e-6);
  }
}

TEST(Splat, OrthographicIsTheLimitOfAFarPinhole) {
  Rng rng(3);
  capture::Lens orthographic = pinhole();
  orthographic.model = capture::Lens::Model::orthographic;
  for (int trial = 0; trial < 100; ++trial) {
    const Disc near = randomDisc(rng, 2);
    const auto difference = [&](double distance) {
      Disc far = near;
      far.p = far.p + Direction3<CameraSpace, double>(0, 0, -distance);
      capture::Lens lens = orthographic;
      lens.model = capture::Lens::Model::pinhole;
      lens.focalX = lens.focalY = orthographic.focalX * distance;
      const auto a = project(orthographic, near.p, near.u, near.v, 0.1);
      const auto b = project(lens, far.p, far.u, far.v, 0.1);
      return (a.mean - b.mean).head<2>().norm() / 700 +
             (a.covariance - b.covariance).topLeftCorner<2, 2>().norm() / (700 * 700);
    };
    EXPECT_LT(difference(1e4), 5e-4);
    EXPECT_LT(difference(1e6), 5e-6);
  }
}

// A cloud of one splat; its rest position is its drawn position.
struct OneSplat {
  Point3<ObjectSpace> p{0, 0, 0};
  Direction3<ObjectSpace> u{1, 0, 0}, v{0, 1, 0};
  Handedness handedness = Handedness::kept;
  float radius = 0.1f, coverage = 0.5f;

  std::variant<Footprint, Rejection> seenBy(const capture::Camera<ObjectSpace>& camera,
                                            const SplatOptions& options = {}) const {
    return footprintOf(camera, {{&p, 1}, {&u, 1}, {&v, 1}, {&handedness, 1}, {&radius, 1}, {&coverage, 1}}, 0,
                       options);
  }
};

OneSplat randomSplat(Rng& rng) {
  const Disc disc = randomDisc(rng, 0.1);
  OneSplat splat{assume<Point3<ObjectSpace>>(disc.p.raw()), assume<Direction3<ObjectSpace>>(disc.u.raw()),
                 assume<Direction3<ObjectSpace>>(disc.v.raw())};
  if (disc.normal().z() < 0.1) splat.v = Direction3<ObjectSpace>() + -splat.v;
  return splat;
}

TEST(Splat, ItsOrderIsThatOfItsPlaneAtEveryPixel) {
  Rng rng(4);
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic})
    for (int trial = 0; trial < 200; ++trial) {
      const OneSplat splat = randomSplat(rng);
      auto camera = lookAt({0.3, 0.2, 5}, {0, 0, 0}, 640, 480, 1000);
      camera.lens.model = model;
      const auto result = splat.seenBy(camera, {.lowPass = 1e-3});
      if (!std::holds_alternative<Footprint>(result)) continue; // faces away
      const Footprint& f = std::get<Footprint>(result);
      for (const double a : {-0.05, 0.0, 0.08})
        for (const double b : {-0.07, 0.0, 0.06}) {
          const auto point = assume<Point3<ObjectSpace, double>>(V3(splat.p.raw().cast<double>() +
                                                                    a * splat.u.raw().cast<double>() +
                                                                    b * splat.v.raw().cast<double>()));
          const auto pixel = camera.project(point);
          const double order = f.order + f.orderX * (pixel->x - f.x) + f.orderY * (pixel->y - f.y);
          EXPECT_NEAR(depthOfOrder(camera.lens, order), -camera.cameraFromWorld(point).z(), 2.4e-6);
        }
    }
}

TEST(Splat, TheLowPassKeepsItsEnergyHoweverSmallItIs) {
  Rng rng(5);
  for (int trial = 0; trial < 200; ++trial) {
    OneSplat splat = randomSplat(rng);
    splat.radius = static_cast<float>(std::pow(10, uniform(rng, -4, -1)));
    const auto camera = lookAt({0, 0, 5}, {0, 0, 0}, 640, 480, 500);
    const auto result = splat.seenBy(camera);
    if (!std::holds_alternative<Footprint>(result)) continue; // faces away
    const Footprint& f = std::get<Footprint>(result);
    const auto unfiltered =
        project(camera.lens, camera.cameraFromWorld(splat.p.cast<double>()),
                camera.cameraFromWorld(splat.u.cast<double>()),
                camera.cameraFromWorld(splat.v.cast<double>()), kSigmaPerRadius * splat.radius);
    const double areaOfSigma = std::sqrt(unfiltered.covariance.topLeftCorner<2, 2>().determinant());
    // The mass of peak exp(-q/2) is 2 pi peak / sqrt(xx yy).
    EXPECT_NEAR(f.peak / std::sqrt(f.xx * f.yy) / (splat.coverage * areaOfSigma), 1, 2.5e-7);
  }
}

Rejection rejectionOf(const OneSplat& splat, const SplatOptions& options = {}) {
  const auto camera = lookAt({0, 0, 5}, {0, 0, 0}, 640, 480, 1000);
  return std::get<Rejection>(splat.seenBy(camera, options));
}

TEST(Splat, SaysWhyItIsNotDrawn) {
  OneSplat seen, dead, away, behind, outside;
  EXPECT_TRUE(std::holds_alternative<Footprint>(seen.seenBy(lookAt({0, 0, 5}, {0, 0, 0}, 640, 480, 1000))));
  dead.handedness = Handedness::dead;
  EXPECT_EQ(rejectionOf(dead), Rejection::dead);
  away.handedness = Handedness::mirrored;
  EXPECT_EQ(rejectionOf(away), Rejection::backFacing);
  behind.p = {0, 0, 6};
  EXPECT_EQ(rejectionOf(behind), Rejection::tooNear);
  outside.p = {3, 0, 0};
  EXPECT_EQ(rejectionOf(outside), Rejection::outside);
}

TEST(Splat, IsNotDrawnWhenAnyNumberOfItIsNot) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, inf, -inf})
    for (int field = 0; field < 5; ++field) {
      OneSplat splat;
      if (field == 0) splat.p = {0, bad, 0};
      if (field == 1) splat.u = {bad, 0, 0};
      if (field == 2) splat.v = {0, 1, bad};
      if (field == 3) splat.radius = bad;
      if (field == 4) splat.coverage = bad;
      EXPECT_EQ(rejectionOf(splat), Rejection::notFinite) << field;
    }
  OneSplat flat;
  flat.v = flat.u;
  EXPECT_EQ(rejectionOf(flat), Rejection::notFinite);
}

TEST(Splat, TheNearPlaneClipsItsCutOffCircleNotItsCentre) {
  OneSplat splat; // depth 5, cut-off circle of kCutoffSigmas * 0.05 around
  splat.u = {0.6f, 0, 0.8f};
  const double reach = kCutoffSigmas * kSigmaPerRadius * 0.1 * 0.8;
  const auto camera = lookAt({0, 0, 5}, {0, 0, 0}, 640, 480, 1000);
  EXPECT_TRUE(std::holds_alternative<Footprint>(splat.seenBy(camera, {.nearDepth = 5 - 1.001 * reach})));
  EXPECT_EQ(rejectionOf(splat, {.nearDepth = 5 - 0.999 * reach}), Rejection::tooNear);
}

TEST(Splat, WhatTheLensFoldsBackIntoTheImageIsNotSeen) {
  auto camera = lookAt({0, 0, 1}, {0, 0, 0}, 2000, 480, 500);
  camera.lens.k1 = -0.3; // folds at a tangent of 1.05
  OneSplat splat;
  splat.radius = 0.01f;
  splat.p = {0.9f, 0, 0};
  EXPECT_TRUE(std::holds_alternative<Footprint>(splat.seenBy(camera)));
  splat.p = {1.7f, 0, 0};
  ASSERT_NEAR(capture::distort(camera.lens, {1.7, 0})[0], 0.226, 1e-3);
  EXPECT_EQ(std::get<Rejection>(splat.seenBy(camera)), Rejection::outside);
}

} // namespace
} // namespace surflect::splat
