#include "srf/query/enclosed.h"

#include "surfel/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace surflect {
namespace {

constexpr double kPi = std::numbers::pi;

// A sphere's part from the pole +z to the polar angle `end`, facing outwards; closed if that is pi.
void addSphere(TriangleMesh& mesh, const Vec3<double>& center, double radius, double end = kPi,
               uint32_t n = 48) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (uint32_t j = 0; j <= n; ++j)
    for (uint32_t i = 0; i < 2 * n; ++i) {
      const double theta = end * j / n, phi = kPi * i / n;
      const Vec3<double> p = center + radius * Vec3<double>(std::sin(theta) * std::cos(phi),
                                                            std::sin(theta) * std::sin(phi), std::cos(theta));
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p));
    }
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < 2 * n; ++i) {
      const uint32_t a = first + 2 * n * j + i, b = first + 2 * n * j + (i + 1) % (2 * n);
      if (j > 0) mesh.triangles.push_back({a, a + 2 * n, b});
      if (j + 1 < n || end < kPi) mesh.triangles.push_back({b, a + 2 * n, b + 2 * n});
    }
}

void turnInsideOut(TriangleMesh& mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
}

TriangleMesh opened(const TriangleMesh& mesh) {
  return withoutEnclosed(mesh, RayCaster<AcquisitionSpace>(mesh), 0.02);
}

TEST(Winding, CountsTheSolidsAroundAPointAlongEveryRay) {
  TriangleMesh mesh;
  const std::vector<Vec3<double>> centers{{0, 0, 0}, {0.7, 0.2, 0.1}, {0.2, -0.6, 0.3}};
  for (const auto& center : centers) addSphere(mesh, center, 0.8);
  const RayCaster<AcquisitionSpace> rays(mesh);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  std::normal_distribution<double> normal;
  std::array<int, 4> met{};
  for (int trial = 0; trial < 3000; ++trial) {
    const Vec3<double> p(place(random), place(random), place(random));
    int expected = 0;
    bool nearSurface = false;
    for (const auto& center : centers) {
      const double distance = (p - center).norm();
      expected += distance < 0.8;
      nearSurface |= std::abs(distance - 0.8) < 0.01;
    }
    const Direction3<AcquisitionSpace, double> direction(normal(random), normal(random), normal(random));
    if (nearSurface) continue;
    ++met[static_cast<size_t>(expected)];
    EXPECT_EQ(rays.winding(assume<Point3<AcquisitionSpace, double>>(p), normalized(direction)), expected);
  }
  for (const int count : met) EXPECT_GT(count, 10);
}

// Two unit spheres at the distance d: each loses a cap of height 1 - d/2, whose area is 2 pi (1 - d/2).
TEST(WithoutEnclosed, LeavesTheSurfaceOfTheUnion) {
  for (const double d : {0.6, 1.2, 1.8}) {
    TriangleMesh mesh;
    addSphere(mesh, {0, 0, 0}, 1, kPi, 96);
    addSphere(mesh, {0, 0, d}, 1, kPi, 96);
    const double expected = 8 * kPi - 2 * 2 * kPi * (1 - d / 2);
    // Triangles that are cut stay: a ring of them, as high as a triangle.
    const double ring = 2 * 2 * kPi * std::sqrt(1 - d * d / 4) * (kPi / 96);
    const double area = surfaceArea(opened(mesh));
    EXPECT_GT(area, expected * 0.999);
    EXPECT_LT(area, expected + ring);
  }
}

TEST(WithoutEnclosed, KeepsWhatAnyOpeningLeadsTo) {
  TriangleMesh vase; // a thick shell with a mouth of 3 degrees, closed at its rim
  addSphere(vase, {0, 0, 0}, 0.9, kPi - 0.05);
  turnInsideOut(vase);
  const size_t inner = vase.positions.size();
  addSphere(vase, {0, 0, 0}, 1, kPi - 0.05);
  for (uint32_t i = 0; i < 96; ++i) { // the rim, from the lowest ring of one to that of the other
    const auto a = static_cast<uint32_t>(inner - 96) + i,
               b = static_cast<uint32_t>(inner - 96) + (i + 1) % 96;
    const auto offset = static_cast<uint32_t>(inner);
    vase.triangles.push_back({a, b, b + offset});
    vase.triangles.push_back({a, b + offset, a + offset});
  }
  EXPECT_EQ(opened(vase).triangles, vase.triangles);
}

TEST(WithoutEnclosed, KeepsOpenSurfacesAndThoseInsideOut) {
  TriangleMesh bowl, ball;
  addSphere(bowl, {0, 0, 0}, 1, kPi / 2);
  addSphere(bowl, {0, 0, 0}, 0.5, kPi / 2); // under it
  EXPECT_EQ(opened(bowl).triangles, bowl.triangles);
  turnInsideOut(bowl);
  EXPECT_EQ(opened(bowl).triangles, bowl.triangles);
  addSphere(ball, {0, 0, 0}, 1);
  turnInsideOut(ball);
  EXPECT_EQ(opened(ball).triangles, ball.triangles);
}

// Corners, and the middles of the triangles, lie inside of balls; all else shows.
TEST(Enclosed, ATriangleStaysOfWhichAnyPartShows) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(
        Vec3<double>(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const size_t ofBox = mesh.triangles.size();
  const auto corners = mesh.positions;
  for (const auto& p : corners) addSphere(mesh, p.raw().cast<double>(), 0.2, kPi, 12);
  for (size_t t = 0; t < ofBox; ++t) {
    Vec3<double> middle = Vec3<double>::Zero();
    for (const uint32_t v : mesh.triangles[t]) middle += corners[v].raw().cast<double>() / 3;
    addSphere(mesh, middle, 0.2, kPi, 12);
  }
  const TriangleMesh open = opened(mesh);
  EXPECT_TRUE(std::equal(mesh.triangles.begin(), mesh.triangles.begin() + ofBox, open.triangles.begin()));
  EXPECT_LT(open.triangles.size(), mesh.triangles.size()); // halves of the balls are inside
}

} // namespace
} // namespace surflect
