#include "render/lightfield/slf/cone.h"

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
} // namespace surflect::slf
