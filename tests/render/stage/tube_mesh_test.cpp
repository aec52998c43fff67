#include "render/stage/tube_mesh.h"

#include "surfel/base/error.h"
#include "tests/render/stage/surfaces.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::stage {
namespace {

using Vector = Vec3<double>;

std::vector<CurvePoint> ring(size_t count, double radius, double thickness) {
  std::vector<CurvePoint> points;
  for (size_t i = 0; i < count; ++i) {
    const double phi = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    points.push_back({Vector(radius * std::cos(phi), radius * std::sin(phi), 0), thickness});
  }
  return points;
}

const std::vector<CurvePoint> bow{
    {Vector(0, 0, 0), 0.1}, {Vector(0.5, 0, 0.4), 0.12}, {Vector(1, 0.3, 0.2), 0.05}};

TEST(Tube, RoundALineIsACylinderWithHalfSpheres) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 5; ++trial) {
    const double x = normal(random), y = normal(random), z = normal(random);
    const Vector way(x, y, z);
    const double r = 0.2, l = way.norm();
    const Surface rod =
        tube(std::vector<CurvePoint>{{Vector(1, 1, 1), r}, {Vector(1, 1, 1) + way, r}}, false, 128);
    EXPECT_TRUE(isClosed(rod.mesh));
    EXPECT_NEAR(volumeOf(rod.mesh), std::numbers::pi * r * r * l + 4 * std::numbers::pi / 3 * r * r * r,
                2e-3 * (l + r) * r * r * std::numbers::pi);
    EXPECT_NEAR(areaOf(rod.mesh), 2 * std::numbers::pi * r * l + 4 * std::numbers::pi * r * r,
                2e-3 * 2 * std::numbers::pi * r * (l + 2 * r));
    EXPECT_LT(largestTilt(rod), 0.06);
    for (size_t i = 0; i < rod.tangents.size(); ++i) { // along the rod, but at its round ends
      const double along =
          (rod.mesh.positions[i].cast<double>().raw() - Vector(1, 1, 1)).dot(way.normalized());
      if (along > 1e-6 && along < l - 1e-6) {
        EXPECT_NEAR(rod.tangents[i].raw().dot(way.normalized()), 1, 1e-9);
      }
    }
  }
}

TEST(Tube, RoundACircleIsATorus) {
  const double big = 1, small = 0.25;
  const Surface torus = tube(ring(64, big, small), true, 256);
  EXPECT_TRUE(isClosed(torus.mesh));
  EXPECT_NEAR(volumeOf(torus.mesh), 2 * std::numbers::pi * std::numbers::pi * big * small * small, 2e-3);
  EXPECT_NEAR(areaOf(torus.mesh), 4 * std::numbers::pi * std::numbers::pi * big * small, 1e-2);
  for (size_t i = 0; i < torus.tangents.size(); ++i) EXPECT_NEAR(torus.tangents[i].raw().z(), 0, 1e-2);
}

TEST(Tube, TaperedAndCurvedHasTheNormalsOfItsTriangles) {
  const Surface coarse = tube(bow, false, 32), fine = tube(bow, false, 128);
  EXPECT_TRUE(isClosed(fine.mesh));
  EXPECT_LT(largestLift(fine), 1e-9);
  EXPECT_LT(largestTilt(coarse), 0.4);
  EXPECT_LT(largestTilt(fine), 0.15);
}

TEST(Tube, EndsInAPointWhereItHasNoThickness) {
  const Surface hair =
      tube(std::vector<CurvePoint>{{Vector(0, 0, 0), 0.1}, {Vector(0, 0, 1), 0}}, false, 128);
  EXPECT_TRUE(isClosed(hair.mesh));
  EXPECT_NEAR(volumeOf(hair.mesh), std::numbers::pi * 0.01 / 3 + 2 * std::numbers::pi / 3 * 0.001, 2e-5);
}

TEST(Braid, StrandsPassOverEachOtherInTurn) {
  const BraidShape shape{6, 12};
  const Surface plait =
      braid(std::vector<CurvePoint>{{Vector(0, 0, 0), 0.1}, {Vector(2, 0, 0), 0.1}}, false, shape);
  EXPECT_TRUE(isClosed(plait.mesh));
  // The braid is as wide as twice the radius along z, and flatter along y; its tangents run along x on
  // average.
  Eigen::AlignedBox3f bounds;
  for (const auto& p : plait.mesh.positions) bounds.extend(p.raw());
  EXPECT_NEAR(bounds.sizes().z(), 0.2, 0.02);
  EXPECT_NEAR(bounds.sizes().y(), 0.16, 0.02);
  Vector sum = Vector::Zero();
  for (const auto& t : plait.tangents) sum += t.raw();
  EXPECT_GT(sum.normalized().x(), 0.99);
}

TEST(Braid, ClosesRoundARingAndIsTheSameForASeed) {
  const BraidShape shape{8, 10, 5}, other{8, 10, 6};
  const auto points = ring(8, 1, 0.1);
  const Surface one = braid(points, true, shape), again = braid(points, true, shape),
                differs = braid(points, true, other);
  EXPECT_TRUE(isClosed(one.mesh));
  EXPECT_EQ(one.mesh.positions, again.mesh.positions);
  EXPECT_NE(one.mesh.positions, differs.mesh.positions);
}

TEST(Braid, TooManyTrianglesAreAnError) { EXPECT_THROW(braid(bow, false, {10'000, 1000}), Error); }

} // namespace
} // namespace surflect::stage
