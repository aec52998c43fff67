#include "render/surfels/cast_shadows.h"

#include "surfel/sampling.h"
#include "warp/deform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

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
        cloud.coverage.push_back(0.44f); // Gaussians add up to 1
      }
  };
  addSquare(2, 0);
  addSquare(0.5f, 1);
  return cloud;
}

Occluders allOf(const SurfelCloud& cloud) {
  Occluders occluders{{}, {}, kSpacing};
  for (uint32_t i = 0; i < cloud.size(); ++i) {
    occluders.surfels.push_back(i);
    occluders.splats.push_back({cloud.radius[i], cloud.coverage[i]});
  }
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
    if (std::min(std::abs(x - low), std::abs(x - high)) < 5 * kSpacing)
      continue; // stretched splats overlap it
    EXPECT_EQ(batch.reached[i], x > low && x < high ? 0 : 1) << x;
    hidden += batch.reached[i] == 0;
  }
  EXPECT_GT(hidden, 50u);
}

scene::ShotLight lamp(double x, double z) {
  return scene::ShotDirectionalLight{normalized(Direction3<ObjectSpace, double>(x, 0, z)), {1, 1, 1}};
}

// Height of a folded sheet, straight along y.
constexpr double kPeriod = 12, kHeight = 3; // of the folds, in spacings
double foldAt(double x, double spacing) {
  return kHeight * spacing * std::cos(2 * std::numbers::pi * x / (kPeriod * spacing));
}

TriangleMesh foldedSheet(double spacing) {
  const uint32_t across = 6 * 32, along = 8; // half-folds of 16 facets; 6 folds
  TriangleMesh mesh;
  for (uint32_t j = 0; j <= along; ++j)
    for (uint32_t i = 0; i <= across; ++i) {
      const double x = kPeriod * spacing * (i / 32.0 - 3);
      mesh.positions.push_back({static_cast<float>(x), static_cast<float>(10 * spacing * (j - 4.0)),
                                static_cast<float>(foldAt(x, spacing))});
    }
  for (uint32_t j = 0; j < along; ++j)
    for (uint32_t i = 0; i < across; ++i) {
      const uint32_t a = j * (across + 1) + i, b = a + across + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  return mesh;
}

// The edge of the shadow that a fold casts on the next one is straight along the folds. Opaque discs as wide
// as the splats cast a ragged one.
TEST(CastShadows, AFoldCastsAStraightEdgeOnTheNext) {
  const float spacing = 0.02f;
  SurfelCloud cloud = sampleSurfels(foldedSheet(spacing), spacing);
  Occluders occluders = allOf(cloud);
  occluders.clearance = spacing;
  // Across the edge, upwards from kFrom spacings beside the middle fold's bottom.
  const size_t steps = 100, lines = 100;
  const double kFrom = 1.4, kStep = 0.02;
  const auto add = [&](double x, double y) {
    const double step = 1e-4;
    const double slope = (foldAt(x + step, spacing) - foldAt(x - step, spacing)) / (2 * step);
    cloud.p0.push_back(
        {static_cast<float>(x), static_cast<float>(y), static_cast<float>(foldAt(x, spacing))});
    cloud.r0.push_back(rodriguesOf(
        assume<Normal3<AcquisitionSpace>>(Vec3<float>(static_cast<float>(-slope), 0, 1).normalized())));
    cloud.radius.push_back(spacing);
    cloud.coverage.push_back(1);
  };
  std::vector<uint32_t> probes;
  for (size_t line = 0; line < lines; ++line)
    for (size_t i = 0; i < steps; ++i) {
      probes.push_back(static_cast<uint32_t>(cloud.size()));
      add(spacing * (kPeriod / 2 + kFrom + kStep * (static_cast<double>(i) + 0.5)),
          spacing * (0.3 * static_cast<double>(line) - 15));
    }
  const auto still = warp::chainWarp({});
  weights::QueryBatch batch;
  CastShadows(occluders, cloud, {*still, {}, {lamp(-1, 0.5)}})
      .fill(warp::deform(cloud, *still), probes, batch);
  std::vector<double> edges; // from the bottom, in spacings
  for (size_t line = 0; line < lines; ++line) {
    double hidden = kFrom;
    for (size_t i = 0; i < steps; ++i) hidden += kStep * (1 - double{batch.reached[line * steps + i]});
    edges.push_back(hidden);
  }
  double mean = 0, squares = 0;
  for (const double edge : edges) mean += edge / lines;
  for (const double edge : edges) squares += (edge - mean) * (edge - mean) / lines;
  // The ray that touches the crest at slope -1/2 meets the next fold 2.339 spacings from its bottom.
  EXPECT_NEAR(mean, 2.339, 0.15);
  EXPECT_LT(std::sqrt(squares), 0.02);
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
  ASSERT_EQ(occluders.splats.size(), cloud.size());
  EXPECT_EQ(occluders.splats[7], (DetailSplat{cloud.radius[7], cloud.coverage[7]}));
  EXPECT_FLOAT_EQ(occluders.clearance, kSpacing);
}

} // namespace
} // namespace surflect::surfels
