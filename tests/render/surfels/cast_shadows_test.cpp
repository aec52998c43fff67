#include "render/surfels/cast_shadows.h"

#include "warp/deform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

namespace surflect::surfels {
namespace {

constexpr float kSpacing = 0.05f;

// A floor of 4 x 4 at z = 0, and a roof of 1 x 1 above its middle at z = 1.
SurfelCloud floorUnderRoof() {
  SurfelCloud cloud;
  const auto addSquare = [&](float half, float z) {
    for (float y = -half; y < half; y += kSpacing)
      for (float x = -half; x < half; x += kSpacing) {
        cloud.p0.push_back({x, y, z});
        cloud.r0.push_back({0, 0, 0});
        cloud.radius.push_back(kSpacing);
        cloud.coverage.push_back(0.2f);
      }
  };
  addSquare(2, 0);
  addSquare(0.5f, 1);
  return cloud;
}

Occluders allOf(const SurfelCloud& cloud) {
  Occluders occluders{{}, cloud.radius, kSpacing};
  for (uint32_t i = 0; i < cloud.size(); ++i) occluders.surfels.push_back(i);
  return occluders;
}

// Expects a shadow on the floor's middle line from `low` to `high`, along x of the warped floor.
void expectShadow(const SurfelCloud& cloud, const warp::Warp& warp, const scene::ShotLight& light, double low,
                  double high) {
  const DeformedCloud deformed = warp::deform(cloud, warp);
  const scene::Scene scene{warp, {}, {light}};
  const CastShadows shadows(allOf(cloud), cloud, scene);
  std::vector<uint32_t> surfels;
  for (uint32_t i = 0; i < cloud.size(); ++i)
    if (cloud.p0[i].z() == 0 && std::abs(cloud.p0[i].y()) < 0.2f) surfels.push_back(i);
  weights::QueryBatch batch;
  shadows.fill(deformed, surfels, batch);
  ASSERT_EQ(batch.reached.size(), surfels.size());
  size_t hidden = 0;
  for (size_t i = 0; i < surfels.size(); ++i) {
    const double x = deformed.p[surfels[i]].x();
    if (std::min(std::abs(x - low), std::abs(x - high)) < 3 * kSpacing) continue; // discs overlap the edge
    EXPECT_EQ(batch.reached[i], x > low && x < high ? 0 : 1) << x;
    hidden += batch.reached[i] == 0;
  }
  EXPECT_GT(hidden, 50u);
}

scene::ShotLight lamp(double x, double z) {
  return scene::ShotDirectionalLight{normalized(Direction3<ObjectSpace, double>(x, 0, z)), {1, 1, 1}};
}

TEST(CastShadows, AMovedLampMovesTheEdgeToWhereARaySays) {
  const SurfelCloud cloud = floorUnderRoof();
  const auto still = warp::chainWarp({});
  for (const double slope : {-1.0, -0.3, 0.0, 0.4, 1.0})
    expectShadow(cloud, *still, lamp(slope, 1), -0.5 - slope, 0.5 - slope);
  const auto bulb = scene::ShotPointLight{Point3<ObjectSpace, double>(0.5, 0, 2), {1, 1, 1}};
  expectShadow(cloud, *still, bulb, -1.5, 0.5);
}

TEST(CastShadows, AWarpedObjectCastsTheShadowOfItsNewShape) {
  const SurfelCloud cloud = floorUnderRoof();
  // Twice as high: the roof is at z = 2.
  const auto high = warp::scaleWarp({1, 1, 2}, {0, 0, 0});
  expectShadow(cloud, *high, lamp(0.5, 1), -1.5, -0.5);
  // Mirrored, and twice as wide.
  const auto mirrored = warp::scaleWarp({-2, 1, 1}, {0, 0, 0});
  expectShadow(cloud, *mirrored, lamp(1, 1), -2, 0);
}

TEST(CastShadows, WhatTurnsAwayIsInShadow) {
  const SurfelCloud cloud = floorUnderRoof();
  const auto still = warp::chainWarp({});
  const scene::Scene scene{*still, {}, {lamp(0, -1)}};
  const CastShadows shadows(allOf(cloud), cloud, scene);
  weights::QueryBatch batch;
  const std::vector<uint32_t> surfels{0, 1, 2};
  shadows.fill(warp::deform(cloud, *still), surfels, batch);
  EXPECT_EQ(batch.reached, (std::vector<float>{0, 0, 0}));
}

TEST(CastShadows, AreUsedUnderKrigingIfTheModelOrTheOptionChoosesThem) {
  weights::ReflectanceField field;
  field.rig.lights.resize(1);
  field.lightVisibility.emplace();
  field.levels.emplace();
  const weights::ShadeOptions separate{.interpolation = weights::Interpolation::separate},
      kriging{.interpolation = weights::Interpolation::kriging};
  EXPECT_TRUE(castsShadows(field, kriging, {}));
  EXPECT_FALSE(castsShadows(field, kriging, false));
  EXPECT_FALSE(castsShadows(field, separate, true));
  field.interpolation.shadows = false;
  EXPECT_FALSE(castsShadows(field, kriging, {}));
  EXPECT_TRUE(castsShadows(field, kriging, true));
  field.lightVisibility.reset();
  EXPECT_FALSE(castsShadows(field, kriging, true));
}

TEST(Occluders, AreTheFinestLevelThatIsSmallEnough) {
  const SurfelCloud cloud = floorUnderRoof();
  const LevelsOfDetail levels = levelsOfDetail(cloud);
  const Occluders occluders = occludersOf(cloud, levels);
  EXPECT_EQ(occluders.surfels.size(), cloud.size()); // few: level 0
  EXPECT_EQ(occluders.radius, cloud.radius);
  EXPECT_FLOAT_EQ(occluders.clearance, kSpacing);
}

} // namespace
} // namespace surflect::surfels
