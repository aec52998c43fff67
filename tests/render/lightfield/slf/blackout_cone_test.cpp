#include "render/lightfield/slf/blackout_cone.h"

#include "bench/slf/synthetic_field.h"
#include "tests/render/lightfield/slf/cameras.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <random>
#include <span>
#include <vector>

namespace surflect::slf {

namespace {

using namespace testing;

std::vector<uint32_t> allTriangles(const TriangleMesh& mesh) {
  std::vector<uint32_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

// Pyramid of n sides without its base, whose sides have that angle to the axis z.
TriangleMesh pyramid(uint32_t n, double angle) {
  std::vector<Vec3<double>> positions = {{0, 0, std::tan(angle)}};
  Triangles triangles;
  for (uint32_t i = 0; i < n; ++i) {
    const double around = 2 * std::numbers::pi * i / n;
    // Sides at distance 1 from the axis.
    positions.push_back(Vec3<double>(std::cos(around), std::sin(around), 0) / std::cos(std::numbers::pi / n));
    triangles.push_back({0, 1 + i, 1 + (i + 1) % n});
  }
  return meshOf(positions, triangles);
}

TEST(Cone, OfThePyramidsNormalsIsAlongItsAxis) {
  for (const double angle : {0.1, 0.7, 1.4}) {
    const TriangleMesh mesh = pyramid(5, angle);
    const Cone cone = normalCone(mesh, allTriangles(mesh));
    EXPECT_NEAR(cone.halfAngle.radians(), angle, 0.01 * angle);
    EXPECT_LT(angleBetween(cone.axis, Vec3<double>::UnitZ()), 0.02);
  }
}

TEST(Cone, UnevenAreasDoNotWidenIt) {
  // Many triangles face one way, one faces away by 1 radian: the axis is half-way.
  TriangleMesh mesh = squarePatch(20);
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  mesh = together(mesh, meshOf({{0, 0, 0}, {1, 0, 0}, {0, std::cos(1), std::sin(1)}}, {{0, 1, 2}}));
  ASSERT_EQ(mesh.triangles.back()[0], first);
  EXPECT_NEAR(normalCone(mesh, allTriangles(mesh)).halfAngle.radians(), 0.5, 0.005);
}

TEST(Cone, TrianglesWithoutAreaHaveNoNormal) {
  const TriangleMesh line = meshOf({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}});
  EXPECT_TRUE(normalCone(line, allTriangles(line)).isEmpty());
  const TriangleMesh mesh = together(line, squarePatch(1));
  EXPECT_EQ(normalCone(mesh, allTriangles(mesh)).halfAngle.radians(), 0);
}

TEST(Cone, ConeAroundTwoHoldsBothAndTouchesBoth) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> width(0, 0.7);
  const auto draw = [&] {
    return Cone{Vec3<double>(normal(random), normal(random), normal(random)).normalized(),
                Angle::fromRadians(width(random))};
  };
  for (int trial = 0; trial < 1000; ++trial) {
    const Cone a = draw(), b = draw(), both = coneAround(a, b);
    const double toA = angleBetween(both.axis, a.axis) + a.halfAngle.radians();
    const double toB = angleBetween(both.axis, b.axis) + b.halfAngle.radians();
    EXPECT_NEAR(std::max(toA, toB), both.halfAngle.radians(), 1e-7);
    const double between = angleBetween(a.axis, b.axis);
    const double smallest = std::max({a.halfAngle.radians(), b.halfAngle.radians(),
                                      (between + a.halfAngle.radians() + b.halfAngle.radians()) / 2});
    EXPECT_NEAR(both.halfAngle.radians(), std::min(smallest, std::numbers::pi), 1e-12);
  }
}

TEST(Cone, ConeAroundNoneIsTheOther) {
  const Cone cone{Vec3<double>::UnitX(), Angle::fromRadians(0.3)};
  EXPECT_EQ(coneAround(cone, {}).axis, cone.axis);
  EXPECT_EQ(coneAround({}, cone).halfAngle.radians(), 0.3);
  EXPECT_TRUE(coneAround({}, {}).isEmpty());
}

TEST(Cone, IsAroundItsDirectionsAndNearlyTheNarrowest) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 200; ++trial) {
    // A circle of directions and others inside it.
    const Vec3<double> axis = randomUnit(random), u = axis.unitOrthogonal(), v = axis.cross(u);
    const double angle = std::uniform_real_distribution<double>(0.05, 1.4)(random);
    std::vector<Vec3<double>> directions{Vec3<double>::Zero()};
    for (int i = 0; i < 24; ++i) {
      const double phi = 2 * std::numbers::pi * i / 24, theta = i % 2 ? angle : angle * i / 24;
      directions.push_back(
          (1 + i) * (std::cos(theta) * axis + std::sin(theta) * (std::cos(phi) * u + std::sin(phi) * v)));
    }
    const Cone cone = coneAround(directions);
    for (size_t i = 1; i < directions.size(); ++i)
      ASSERT_LE(angleBetween(cone.axis, directions[i]), cone.halfAngle.radians() + 1e-12);
    EXPECT_LE(cone.halfAngle.radians(), 1.01 * angle);
  }
}

TEST(Cone, OfDirectionsAllAroundIsWide) {
  const std::vector<Vec3<double>> around{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  EXPECT_GE(coneAround(around).halfAngle.radians(), std::numbers::pi / 2);
  EXPECT_TRUE(coneAround(std::span<const Vec3<double>>()).isEmpty());
}

} // namespace

namespace {

using namespace bench;

struct BoundedRegions {
  Field field = syntheticField({.cells = 3, .quads = 5});
  std::vector<RegionBound> bounds;

  BoundedRegions() {
    for (const Region& region : field.regions) bounds.push_back(boundOf(field.mesh, region.chart));
  }
  std::vector<Vec3<double>> points(size_t region) const {
    std::vector<Vec3<double>> points;
    for (const uint32_t vertex : field.regions[region].chart.vertices)
      points.push_back(field.mesh.positions[vertex].cast<double>().raw());
    return points;
  }
};

Vec3<double> randomPlace(std::mt19937& random, double nearest) {
  std::uniform_real_distribution<double> distance(nearest, 4);
  const double d = distance(random);
  return d * randomUnit(random);
}

TEST(BlackoutCone, ThePrismReachesAsFarAsTheRegionInEveryDirection) {
  const BoundedRegions regions;
  std::mt19937 random(1);
  for (size_t r = 0; r < regions.bounds.size(); ++r)
    for (int trial = 0; trial < 100; ++trial) {
      const Vec3<double> along = randomUnit(random);
      double prism = -1e9, region = -1e9;
      for (const Vec3<double>& corner : regions.bounds[r].corners) prism = std::max(prism, along.dot(corner));
      for (const Vec3<double>& point : regions.points(r)) region = std::max(region, along.dot(point));
      ASSERT_GE(prism, region - 1e-12);
    }
}

TEST(BlackoutCone, TheViewConeHoldsTheDirectionsFromAllOfTheRegion) {
  const BoundedRegions regions;
  std::mt19937 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3<double> viewer = randomPlace(random, 0);
    for (size_t r = 0; r < regions.bounds.size(); ++r) {
      const RegionView view = viewOf(regions.bounds[r], viewer);
      for (const Vec3<double>& point : regions.points(r))
        ASSERT_LE(angleBetween(view.cone.axis, viewer - point), view.cone.halfAngle.radians() + 1e-9);
    }
  }
}

TEST(BlackoutCone, FromInsideThePrismAllDirectionsArePossible) {
  const BoundedRegions regions;
  for (const RegionBound& bound : regions.bounds) {
    Vec3<double> middle = Vec3<double>::Zero();
    for (const Vec3<double>& corner : bound.corners) middle += corner / static_cast<double>(kPrismCorners);
    EXPECT_EQ(viewOf(bound, middle).cone.halfAngle.radians(), std::numbers::pi);
    EXPECT_EQ(viewOf(bound, bound.corners[3]).cone.halfAngle.radians(), std::numbers::pi);
    EXPECT_EQ(viewOf(bound, 0.9 * middle + 0.1 * bound.corners[5]).cone.halfAngle.radians(),
              std::numbers::pi);
  }
}

TEST(BlackoutCone, ARegionFacesAwayOnlyIfAllOfItsTrianglesDo) {
  const BoundedRegions regions;
  std::mt19937 random(4);
  int away = 0, back = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3<double> viewer = randomPlace(random, 1.2);
    for (size_t r = 0; r < regions.bounds.size(); ++r) {
      const std::vector<Vec3<double>> points = regions.points(r);
      bool isBack = true;
      for (const auto& [a, b, c] : regions.field.regions[r].chart.triangles)
        isBack &= (points[b] - points[a]).cross(points[c] - points[a]).dot(viewer - points[a]) < 0;
      const bool found = isBackFacing(regions.bounds[r], viewOf(regions.bounds[r], viewer));
      ASSERT_TRUE(isBack || !found);
      away += found;
      back += isBack;
    }
  }
  EXPECT_GT(away, back / 2);
}

TEST(BlackoutCone, ATriangleWithoutAreaDoesNotTurnARegion) {
  BoundedRegions regions;
  Chart chart = regions.field.regions[0].chart;
  chart.triangles.push_back({0, 0, 1});
  const RegionBound with = boundOf(regions.field.mesh, chart), without = regions.bounds[0];
  EXPECT_EQ(with.blackout.halfAngle.radians(), without.blackout.halfAngle.radians());
  chart.triangles = {{0, 0, 1}}; // of no area at all
  EXPECT_TRUE(boundOf(regions.field.mesh, chart).blackout.isEmpty());
}

TEST(BlackoutCone, IsOppositeToTheNormalsAndARightAngleFromThem) {
  const Cone normals{Vec3<double>(0.6, 0, 0.8), Angle::fromRadians(0.5)}, blackout = blackoutCone(normals);
  EXPECT_EQ(blackout.axis, -normals.axis);
  EXPECT_NEAR(blackout.halfAngle.radians(), std::numbers::pi / 2 - 0.5 - kTurnOver, 1e-12);
  EXPECT_TRUE(blackoutCone({normals.axis, Angle::fromRadians(std::numbers::pi / 2)}).isEmpty());
  EXPECT_TRUE(blackoutCone({}).isEmpty());
}

TEST(BlackoutCone, TheScreenRectHoldsAllPixelsOfTheRegion) {
  const BoundedRegions regions;
  std::mt19937 random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const Camera camera = cameraAt(randomPlace(random, 0), randomUnit(random), 64, 48, 50);
    for (size_t r = 0; r < regions.bounds.size(); ++r) {
      const auto rect = screenRect(regions.bounds[r], camera);
      for (const Vec3<double>& point : regions.points(r)) {
        const auto pixel = camera.project(assume<Point3<AcquisitionSpace, double>>(point));
        if (!pixel || !contains(camera.lens, *pixel)) continue;
        ASSERT_TRUE(rect.has_value());
        ASSERT_GE(pixel->x, rect->x);
        ASSERT_GE(pixel->y, rect->y);
        ASSERT_LE(pixel->x, rect->x + rect->width);
        ASSERT_LE(pixel->y, rect->y + rect->height);
      }
      if (rect) {
        ASSERT_TRUE(rect->x >= 0 && rect->y >= 0 && rect->width > 0 && rect->height > 0);
        ASSERT_TRUE(rect->x + rect->width <= 64 && rect->y + rect->height <= 48);
      }
    }
  }
}

TEST(BlackoutCone, NoPixelShowsARegionBehindTheCamera) {
  const BoundedRegions regions;
  const Camera camera = cameraAt({0, 0, 3}, {0, 0, 1}, 64, 48, 50);
  for (const RegionBound& bound : regions.bounds) EXPECT_FALSE(screenRect(bound, camera).has_value());
}

} // namespace

} // namespace surflect::slf
