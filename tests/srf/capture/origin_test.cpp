#include "srf/capture/origin.h"

#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

namespace surflect::capture {
namespace {

using Point = Point3<AcquisitionSpace, double>;

// Cameras around the origin, four units away, whose pixels cover 4 / 80 there.
Capture around(const Vec3<double>& middle) {
  Capture capture;
  for (const Vec3<double>& direction : studio::spiral(12)) {
    View view{"", studio::cameraFrom<AcquisitionSpace>(direction, 64)};
    view.camera.lens.focalX = view.camera.lens.focalY = 80;
    const Mat3<double> rotation = view.camera.cameraFromWorld.rotation();
    view.camera.cameraFromWorld = {rotation, Vec3<double>(0, 0, -4) - rotation * middle};
    capture.views.push_back(view);
  }
  return capture;
}

TEST(Origin, IsKeptNearTheScene) {
  EXPECT_EQ(nearerOrigin(around({0, 0, 0})), std::nullopt);
  EXPECT_EQ(nearerOrigin(around({1000, 2000, 50})), std::nullopt);
}

TEST(Origin, OfAFarSceneIsItsMiddleInWholeUnits) {
  const auto origin = nearerOrigin(around({500000.3, 4600000.4, 30.1}));
  ASSERT_TRUE(origin);
  EXPECT_EQ(*origin, Vec3<double>(500000, 4600000, 30));
}

TEST(Origin, StaysWhereOneViewOrCamerasAtOnePlaceTellNoMiddle) {
  Capture capture = around({500000, 4600000, 30});
  for (View& view : capture.views) {
    const Mat3<double> rotation = view.camera.cameraFromWorld.rotation();
    view.camera.cameraFromWorld = {rotation, -rotation * Vec3<double>(500000, 4600000, 30)};
  }
  EXPECT_EQ(nearerOrigin(capture), std::nullopt);
  capture.views.resize(1);
  EXPECT_EQ(nearerOrigin(capture), std::nullopt);
}

TEST(Origin, AxesMeetWhereTheyAreAimed) {
  const auto meeting = whereAxesMeet(around({5, 6, 7}));
  ASSERT_TRUE(meeting);
  EXPECT_LT((meeting->raw() - Vec3<double>(5, 6, 7)).norm(), 1e-13);
}

// Half of the spacing of floats at 2^22, over 4 / 80.
TEST(Origin, RoundingIsHalfTheSpacingOfFloats) {
  const Capture capture = around({4194304, 0, 0});
  EXPECT_NEAR(roundingInPixels(capture, Point(4194304, 0, 0)), 0.25 / (4.0 / 80), 1e-8);
}

TEST(Origin, CountingFromElsewhereChangesNoPictureAndNoLight) {
  Capture capture = around({0, 0, 0});
  capture.lights = studio::studioLights(3, 0.2);
  capture.lights[0].kind = PointLight{Point(1, 2, 3), {4, 5, 6}};
  const Vec3<double> origin(500000, -4600000, 30);
  const Capture moved = countedFrom(capture, origin);
  EXPECT_EQ(moved.origin, origin);
  for (const Vec3<double>& place : {Vec3<double>(0.1, 0.2, 0.3), Vec3<double>(-0.5, 0.4, 0)}) {
    for (size_t v = 0; v < capture.views.size(); ++v) {
      const auto before = capture.views[v].camera.project(assume<Point>(place)),
                 after = moved.views[v].camera.project(assume<Point>(place - origin));
      EXPECT_NEAR(after->x, before->x, 1e-7);
      EXPECT_NEAR(after->y, before->y, 1e-7);
    }
    const Rgb before = irradianceAt(capture.lights[0], assume<Point>(place)),
              after = irradianceAt(moved.lights[0], assume<Point>(place - origin));
    EXPECT_NEAR(after.r, before.r, 1e-6);
  }
  const Capture near = countedFrom(capture, {0.5, 0, 0}); // within the reach of gradients
  EXPECT_NEAR(irradianceAt(near.lights[1], Point(0, 0, 0)).g,
              irradianceAt(capture.lights[1], Point(0.5, 0, 0)).g, 1e-6);
  EXPECT_NEAR(irradianceAt(near.lights[1], Point(-0.5, 0, 0)).g,
              irradianceAt(capture.lights[1], Point(0, 0, 0)).g, 1e-6);
}

} // namespace
} // namespace surflect::capture
