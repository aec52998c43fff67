#include "render/lightfield/common/light_field_renderer.h"

#include "surfel/base/error.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <vector>

namespace surflect::lightfield {
namespace {

const std::vector<Point3<AcquisitionSpace>> kPoints = {{0, 0, 1}, {0.3f, -0.4f, 0.5f}};

bool isShown(const warp::Warp& warp, const std::vector<scene::ShotLight>& lights,
             const std::vector<capture::Light>& baked) {
  capture::Capture rig;
  rig.lights = baked;
  try {
    requireBaked({warp, {}, lights}, rig, kPoints);
    return true;
  } catch (const Error&) {
    return false;
  }
}

TEST(BakedScene, RestWithoutLightsIsShown) { EXPECT_TRUE(isShown(*warp::chainWarp({}), {}, {})); }

TEST(BakedScene, TheLightOfThePhotographsIsShown) {
  const std::vector<capture::Light> lights = studio::studioLights(2);
  const auto rest = warp::chainWarp({});
  EXPECT_TRUE(isShown(*rest, {scene::inObjectSpace(lights[0])}, {lights[0]}));
  EXPECT_FALSE(isShown(*rest, {scene::inObjectSpace(lights[1])}, {lights[0]}));
  EXPECT_FALSE(isShown(*rest, {scene::inObjectSpace(lights[0])}, {}));
  EXPECT_FALSE(
      isShown(*rest, {scene::inObjectSpace(lights[0]), scene::inObjectSpace(lights[0])}, {lights[0]}));
}

TEST(BakedScene, AWarpThatMovesThePointsIsRefused) {
  EXPECT_FALSE(isShown(*warp::scaleWarp({1, 1, 1.0001}, {0, 0, 0}), {}, {}));
  EXPECT_TRUE(isShown(*warp::scaleWarp({1, 1, 1}, {0, 0, 0}), {}, {}));
  EXPECT_FALSE(isShown(*warp::rigidWarp({0, 0, 1}, Angle::fromDegrees(10), {0, 0, 0}, {0, 0, 0}), {}, {}));
}

} // namespace
} // namespace surflect::lightfield
