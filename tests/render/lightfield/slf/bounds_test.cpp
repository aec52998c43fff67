#include "render/lightfield/slf/bounds.h"

#include "bench/slf/synthetic_field.h"
#include "tests/render/lightfield/slf/cameras.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::slf {
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

double angleBetween(const Vec3<double>& a, const Vec3<double>& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Vec3<double> randomPlace(std::mt19937& random, double nearest) {
  std::uniform_real_distribution<double> distance(nearest, 4);
  const double d = distance(random);
  return d * randomUnit(random);
}

TEST(Bounds, ThePrismReachesAsFarAsTheRegionInEveryDirection) {
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

TEST(Bounds, AConeIsAroundItsDirectionsAndNearlyTheNarrowest) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 200; ++trial) {
    // A circle of directions and others inside it.
    const Vec3<double> axis = randomUnit(random), u = axis.unitOrthogonal(), v = axis.cross(u);
    const double angle = std::uniform_real_distribution<double>(0.05, 1.4)(random);
    std::vector<Vec3<double>> directions;
    for (int i = 0; i < 24; ++i) {
      const double phi = 2 * std::numbers::pi * i / 24, theta = i % 2 ? angle : angle * i / 24;
      directions.push_back(
          (1 + i) * (std::cos(theta) * axis + std::sin(theta) * (std::cos(phi) * u + std::sin(phi) * v)));
    }
    const Cone cone = coneAround(directions);
    for (const Vec3<double>& direction : directions)
      ASSERT_LE(angleBetween(cone.axis, direction), cone.angle + 1e-12);
    EXPECT_LE(cone.angle, angle + 0.06);
  }
}

TEST(Bounds, DirectionsAllAroundHaveNoNarrowCone) {
  const std::vector<Vec3<double>> around{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  EXPECT_EQ(coneAround(around).angle, std::numbers::pi);
  EXPECT_EQ(coneAround({}).angle, std::numbers::pi);
  const std::vector<Vec3<double>> withZero{{1, 0, 0}, {0, 0, 0}};
  EXPECT_EQ(coneAround(withZero).angle, std::numbers::pi);
}

TEST(Bounds, TheViewConeHoldsTheDirectionsFromAllOfTheRegion) {
  const BoundedRegions regions;
  std::mt19937 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3<double> viewer = randomPlace(random, 0);
    for (size_t r = 0; r < regions.bounds.size(); ++r) {
      const RegionView view = viewOf(regions.bounds[r], viewer);
      for (const Vec3<double>& point : regions.points(r))
        ASSERT_LE(angleBetween(view.cone.axis, viewer - point), view.cone.angle + 1e-9);
    }
  }
}

TEST(Bounds, FromInsideThePrismAllDirectionsArePossible) {
  const BoundedRegions regions;
  for (const RegionBound& bound : regions.bounds) {
    Vec3<double> middle = Vec3<double>::Zero();
    for (const Vec3<double>& corner : bound.corners) middle += corner / static_cast<double>(kPrismCorners);
    EXPECT_EQ(viewOf(bound, middle).cone.angle, std::numbers::pi);
    EXPECT_EQ(viewOf(bound, bound.corners[3]).cone.angle, std::numbers::pi);
    EXPECT_EQ(viewOf(bound, 0.9 * middle + 0.1 * bound.corners[5]).cone.angle, std::numbers::pi);
  }
}

TEST(Bounds, ARegionFacesAwayOnlyIfAllOfItsTrianglesDo) {
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

TEST(Bounds, ATriangleWithoutAreaDoesNotTurnARegion) {
  BoundedRegions regions;
  Chart chart = regions.field.regions[0].chart;
  chart.triangles.push_back({0, 0, 1});
  const RegionBound with = boundOf(regions.field.mesh, chart), without = regions.bounds[0];
  EXPECT_EQ(with.normals.angle, without.normals.angle);
  chart.triangles = {{0, 0, 1}}; // of no area at all
  EXPECT_EQ(boundOf(regions.field.mesh, chart).normals.angle, std::numbers::pi);
}

TEST(Bounds, TheScreenRectHoldsAllPixelsOfTheRegion) {
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

TEST(Bounds, NoPixelShowsARegionBehindTheCamera) {
  const BoundedRegions regions;
  const Camera camera = cameraAt({0, 0, 3}, {0, 0, 1}, 64, 48, 50);
  for (const RegionBound& bound : regions.bounds) EXPECT_FALSE(screenRect(bound, camera).has_value());
}

} // namespace
} // namespace surflect::slf
