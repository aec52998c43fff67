#include "render/surfels/ground_shadow.h"

#include "render/surfels/frame.h"
#include "tests/render/clouds.h"
#include "tests/render/films.h"
#include "warp/deform.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace surflect::surfels {
namespace {

using V3 = Vec3<double>;

// A unit sphere whose lowest point is on the ground z = -1, seen from above.
struct RestingSphere {
  SurfelCloud cloud;
  Occluders occluders;
  warp::WarpPointer still = warp::chainWarp({});
  capture::Camera<ObjectSpace> camera;
  GroundEnvironments environments;

  RestingSphere() {
    std::mt19937 random(1);
    cloud = testing::unitSphere(20000, random);
    for (uint32_t i = 0; i < cloud.size(); ++i) {
      occluders.surfels.push_back(i);
      occluders.splats.push_back({cloud.radius[i], cloud.coverage[i]});
    }
    camera.lens = {.width = 160, .height = 120, .focalX = 120, .focalY = 120, .centerX = 80, .centerY = 60};
    const V3 eye(0, -5, 5), back = (eye - V3(0, 0, -1)).normalized(), right(1, 0, 0);
    Mat3<double> rotation;
    rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
    camera.cameraFromWorld = {rotation, -(rotation * eye)};
  }
  scene::Scene scene(std::vector<scene::ShotLight> lights, const warp::Warp* warp = nullptr) const {
    return {
        warp ? *warp : *still, camera, std::move(lights),
        scene::ShotGround{Point3<ObjectSpace, double>(3, 1, -1), Normal3<ObjectSpace, double>(0, 0, 1), 1}};
  }
  GroundShadow shadow(std::vector<scene::ShotLight> lights, const warp::Warp* warp = nullptr) {
    return {occluders, cloud, scene(std::move(lights), warp), environments};
  }
};

scene::ShotLight bulb(double x, double y, double z, float strength = 1) {
  return scene::ShotPointLight{Point3<ObjectSpace, double>(x, y, z), {strength, strength, strength}};
}
scene::ShotLight sun(double x, double y, double z, float strength = 1) {
  return scene::ShotDirectionalLight{normalized(Direction3<ObjectSpace, double>(x, y, z)),
                                     {strength, strength, strength}};
}

// Whether a ray from p towards the light meets a unit sphere around the middle.
bool meetsSphere(const V3& p, const scene::ShotLight& light, const V3& middle = {0, 0, 0}) {
  const auto* point = std::get_if<scene::ShotPointLight>(&light);
  const V3 way = point ? V3(point->position.raw() - p)
                       : V3(1e3 * std::get<scene::ShotDirectionalLight>(light).towards.raw());
  const V3 towards = way.normalized(), toMiddle = middle - p;
  const double along = toMiddle.dot(towards);
  return along > 0 && along < way.norm() && (toMiddle - along * towards).norm() < 1;
}

// Expects the shadow where `isDark` says, but for pixels next to its edge. Returns the number of dark pixels.
size_t expectShadow(const GroundShadow& shadow, const std::function<bool(const V3&)>& isDark) {
  const image::Image picture = shadow.picture();
  const auto darkAt = [&](int x, int y) {
    const auto p = shadow.pointAt({x + 0.5, y + 0.5});
    return p && isDark(p->raw());
  };
  size_t dark = 0, wrong = 0;
  for (int y = 1; y + 1 < picture.height; ++y)
    for (int x = 1; x + 1 < picture.width; ++x) {
      const bool expected = darkAt(x, y);
      bool isEdge = false;
      for (int k = 0; k < 9; ++k) isEdge |= darkAt(x + k % 3 - 1, y + k / 3 - 1) != expected;
      if (isEdge) continue;
      wrong += picture.at(x, y)[0] != (expected ? 1 : 0);
      dark += expected;
    }
  EXPECT_EQ(wrong, 0u);
  return dark;
}

TEST(GroundShadow, ItsEdgeLiesWhereARaySays) {
  RestingSphere sphere;
  for (const scene::ShotLight& light :
       {bulb(2, 1, 4), bulb(0, 0, 1.5), bulb(-3, 0, 0.5), sun(1, 0.5, 1), sun(0, 0, 1), sun(-1, 0, 0.4)})
    EXPECT_GT(expectShadow(sphere.shadow({light}), [&](const V3& p) { return meetsSphere(p, light); }), 400u);
}

TEST(GroundShadow, FollowsTheWarpedSurface) {
  RestingSphere sphere;
  const auto aside = warp::rigidWarp({0, 0, 1}, Angle::fromDegrees(40), {0, 0, 0}, {1, 0.5, 0.4});
  const scene::ShotLight light = bulb(2, 1, 4);
  EXPECT_GT(expectShadow(sphere.shadow({light}, &*aside),
                         [&](const V3& p) {
                           return meetsSphere(p, light, {1, 0.5, 0.4});
                         }),
            400u);
}

TEST(GroundShadow, HasNoGapWhereTheObjectTouchesTheGround) {
  RestingSphere sphere;
  const GroundShadow shadow = sphere.shadow({sun(1, 0, 1)});
  for (double x = -2; x < 0; x += 0.01) // the sphere touches the ground at 0
    EXPECT_EQ(shadow.density(Point3<ObjectSpace, double>(x, 0, -1)), 1) << x;
  for (double x = 0.45; x < 2; x += 0.01) // the sun's side, from where a ray leaves the sphere
    EXPECT_EQ(shadow.density(Point3<ObjectSpace, double>(x, 0, -1)), 0) << x;
}

// density = sum w (1 - V) / sum w.
TEST(GroundShadow, LampsAddByTheirIrradiance) {
  RestingSphere sphere;
  const std::vector<scene::ShotLight> lamps{bulb(2, 1, 4, 30), sun(-1, 0.2, 1, 0.75f)};
  const GroundShadow both = sphere.shadow(lamps), first = sphere.shadow({lamps[0]}),
                     second = sphere.shadow({lamps[1]});
  std::mt19937 random(3);
  size_t mixed = 0;
  for (int i = 0; i < 300; ++i) {
    const V3 p(testing::uniform(random, -3, 3), testing::uniform(random, -3, 3), -1);
    const auto at = assume<Point3<ObjectSpace, double>>(p);
    const V3 way = V3(2, 1, 4) - p;
    const double one = 30 * way[2] / std::pow(way.norm(), 3), two = double{0.75f} * 1 / V3(-1, 0.2, 1).norm(),
                 expected = (one * first.density(at) + two * second.density(at)) / (one + two);
    EXPECT_NEAR(both.density(at), expected, 1e-12);
    mixed += expected > 0 && expected < 1;
  }
  EXPECT_GT(mixed, 30u);
}

TEST(GroundShadow, LightFromBelowCountsNothingAndTheBackOfTheGroundIsUnseen) {
  RestingSphere sphere;
  const std::vector<scene::ShotLight> above{bulb(2, 1, 4)}, more{sun(0.3, 0, -1), above[0], bulb(0, 0, -2)};
  EXPECT_EQ(sphere.shadow(more).picture().values, sphere.shadow(above).picture().values);
  const image::Image none = sphere.shadow({more[0]}).picture();
  EXPECT_TRUE(std::ranges::all_of(none.values, [](float density) { return density == 0; }));
  scene::Scene scene = sphere.scene(above);
  scene.ground->normal = {0, 0, -1};
  EXPECT_FALSE(GroundShadow(sphere.occluders, sphere.cloud, scene, sphere.environments).pointAt({80, 60}));
}

// A sky that is brighter above, and a window.
image::Image sky() {
  image::Image sky(128, 64, 3);
  for (int y = 0; y < sky.height; ++y)
    for (int x = 0; x < sky.width; ++x) {
      const bool isWindow = x > 80 && x < 100 && y > 8 && y < 24;
      std::ranges::fill(sky.at(x, y), isWindow ? 6.f : 1.f - float(y) / 80);
    }
  return sky;
}

TEST(GroundShadow, OfAnEnvironmentIsThatOfAllItsLightsRays) {
  RestingSphere sphere;
  Mat3<double> zUp; // y of the map is z of the scene
  zUp << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const auto map = std::make_shared<const weights::EnvironmentMap>(
      weights::environmentOf(sky(), weights::EnvironmentMapping::latLong));
  const GroundShadow shadow =
      sphere.shadow({scene::ShotEnvironment{map, Rotation<ObjectSpace, EnvironmentSpace>(zUp), {1, 1, 1}}});
  const image::Image picture = shadow.picture();
  double worst = 0, squares = 0, darkest = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const auto p = shadow.pointAt({x + 0.5, y + 0.5});
      const double expected = p ? shadow.density(*p) : 0, error = picture.at(x, y)[0] - expected;
      worst = std::max(worst, std::abs(error));
      darkest = std::max(darkest, expected);
      squares += error * error;
    }
  EXPECT_GT(darkest, 0.95);
  EXPECT_LT(worst, 0.02);
  EXPECT_LT(std::sqrt(squares / (160 * 120)), 0.002);
}

TEST(GroundShadow, HasTheSameBitsForAnyNumberOfThreads) {
  RestingSphere sphere;
  const auto map = std::make_shared<const weights::EnvironmentMap>(
      weights::environmentOf(sky(), weights::EnvironmentMapping::latLong));
  const GroundShadow shadow = sphere.shadow(
      {bulb(2, 1, 4, 3), scene::ShotEnvironment{map, Rotation<ObjectSpace, EnvironmentSpace>(), {1, 1, 1}}});
  const image::Image expected = shadow.picture();
  for (const size_t threads : {size_t{1}, size_t{3}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(shadow.picture().values, expected.values);
  }
}

TEST(GroundShadow, LiesBehindTheObject) {
  image::Image color(3, 1, 4), density(3, 1, 1);
  color.values = {0.5f, 0.25f, 0.125f, 0.5f, 1, 1, 1, 1, 0, 0, 0, 0};
  density.values = {0.5f, 1, 0.75f};
  EXPECT_EQ(shadowBehind(color, density, 0.5).values, (std::vector<float>{0.125f, 0, 0.375f}));
}

class GroundOfPackedSphere : public studio::PackedSphere<3000> {
protected:
  method::FrameLayers film(std::optional<scene::ShotGround> ground) {
    const scene::Scene scene{*still_, camera, {bulb(2, 4, 1)}, ground};
    FrameWorkspace workspace(model(), size_t{1} << 28);
    FrameOptions options;
    options.aovs = {"depth", "normal"};
    return renderFrame(model(), scene, options, workspace);
  }
  const warp::WarpPointer still_ = studio::noWarp();
};

TEST_F(GroundOfPackedSphere, LeavesTheObjectItsBits) {
  scene::ShotGround ground{Point3<ObjectSpace, double>(0, -1, 0), Normal3<ObjectSpace, double>(0, 1, 0), 0};
  const method::FrameLayers none = film({}), off = film(ground);
  EXPECT_EQ(off.color.values, none.color.values) << "strength 0";
  EXPECT_TRUE(none.shadow.values.empty());
  EXPECT_EQ(off.shadow.values, std::vector<float>(none.color.values.size() / 4)) << "none is seen";
  ground.shadow = 1;
  const method::FrameLayers on = film(ground);
  EXPECT_EQ(on.color.values, none.color.values);
  EXPECT_EQ(on.aovs.at("depth").values, none.aovs.at("depth").values);
  EXPECT_EQ(on.aovs.at("normal").values, none.aovs.at("normal").values);
  size_t shadowed = 0, atOutlines = 0;
  for (size_t i = 0; i < on.shadow.values.size(); ++i) {
    const float shadow = on.shadow.values[i], alpha = none.color.values[4 * i + 3];
    ASSERT_GE(shadow, 0);
    ASSERT_LE(shadow + alpha, 1 + 0x1p-23f);
    shadowed += alpha == 0 && shadow == 1;
    atOutlines += alpha > 0 && alpha < 1 && shadow > 0;
  }
  EXPECT_GT(shadowed, 20u);
  EXPECT_GT(atOutlines, 5u);
}

} // namespace
} // namespace surflect::surfels
