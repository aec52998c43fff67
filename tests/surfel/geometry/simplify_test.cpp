#include "surfel/geometry/simplify.h"

#include "surfel/geometry/mesh_topology.h"
#include "surfel/geometry/ray_caster.h"
#include "tests/support/random.h"

#include <numbers>
#include <random>
#include <set>

namespace surflect {
namespace {

TriangleMesh sphere(int slices, const Vec3<float>& center = {0, 0, 0}) {
  TriangleMesh mesh;
  for (int j = 0; j <= slices / 2; ++j)
    for (int i = 0; i < slices; ++i) {
      const double theta = std::numbers::pi * j / (slices / 2), phi = 2 * std::numbers::pi * i / slices;
      const Vec3<double> p(std::sin(theta) * std::cos(phi), std::cos(theta),
                           -std::sin(theta) * std::sin(phi));
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(Vec3<float>(center + p.cast<float>())));
    }
  const auto vertex = [&](int j, int i) { return static_cast<uint32_t>(j * slices + i % slices); };
  for (int j = 0; j < slices / 2; ++j)
    for (int i = 0; i < slices; ++i) {
      if (j > 0) mesh.triangles.push_back({vertex(j, i), vertex(j + 1, i), vertex(j, i + 1)});
      if (j + 1 < slices / 2)
        mesh.triangles.push_back({vertex(j, i + 1), vertex(j + 1, i), vertex(j + 1, i + 1)});
    }
  return mesh;
}

TEST(Simplify, ReachesTheNumberOfTriangles) {
  for (const size_t triangles : {20, 199, 1000}) {
    const TriangleMesh simple = simplified(sphere(64), triangles);
    EXPECT_LE(simple.triangles.size(), triangles);
    EXPECT_GE(simple.triangles.size(), triangles * 8 / 10);
  }
}

TEST(Simplify, KeepsTheSurfaceClosedAndNear) {
  const TriangleMesh simple = simplified(sphere(64), 200);
  const RayCaster<AcquisitionSpace> rays(simple);
  std::mt19937 random(1);
  for (int n = 0; n < 200; ++n) {
    const auto direction = assume<Direction3<AcquisitionSpace, double>>(randomUnit(random));
    const auto hit = rays.firstHit({0, 0, 0}, direction);
    ASSERT_TRUE(hit);
    EXPECT_GT(hit->distance, 0.85);
    EXPECT_LE(hit->distance, 1.0001);
    EXPECT_EQ(rays.winding({0, 0, 0}, direction), 1);
  }
}

TEST(Simplify, TakesItsVerticesFromTheMesh) {
  const TriangleMesh mesh = sphere(32), simple = simplified(mesh, 100);
  std::set<std::array<float, 3>> places;
  for (const auto& p : mesh.positions) places.insert({p.x(), p.y(), p.z()});
  for (const auto& p : simple.positions) EXPECT_TRUE(places.contains({p.x(), p.y(), p.z()}));
}

TEST(Simplify, KeepsEachPart) {
  TriangleMesh mesh = sphere(32);
  const TriangleMesh other = sphere(32, {5, 0, 0});
  const auto shift = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({a + shift, b + shift, c + shift});
  EXPECT_EQ(partsOf(simplified(mesh, 100)).parts.size(), 2u);
}

double areaOf(const TriangleMesh& mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) area += areaVector(mesh, t).norm() / 2;
  return area;
}

// Each triangle with vertices of its own.
TriangleMesh soupOf(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<uint32_t>(soup.positions.size());
    for (const uint32_t corner : triangle) soup.positions.push_back(mesh.positions[corner]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

// A ball in a thin ring, whose triangles are many more than the ball's.
TEST(Simplify, APartWithFewTrianglesDoesNotCollapse) {
  TriangleMesh mesh = sphere(48);
  constexpr uint32_t kAround = 256, kAcross = 48;
  const auto shift = static_cast<uint32_t>(mesh.positions.size());
  for (uint32_t i = 0; i < kAround; ++i)
    for (uint32_t j = 0; j < kAcross; ++j) {
      const double a = 2 * std::numbers::pi * i / kAround, b = 2 * std::numbers::pi * j / kAcross;
      const double radius = 1.3 + 0.06 * std::cos(b);
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(
          Vec3<double>(radius * std::cos(a), radius * std::sin(a), 0.06 * std::sin(b))));
      const auto at = [&](uint32_t x, uint32_t y) { return shift + x % kAround * kAcross + y % kAcross; };
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  for (const size_t triangles : {3000, 800, 200})
    for (const TriangleMesh& any : {mesh, soupOf(mesh)}) {
      const TriangleMesh simple = simplified(any, triangles);
      EXPECT_LE(simple.triangles.size(), triangles);
      EXPECT_GT(areaOf(simple), 0.9 * areaOf(mesh)) << triangles;
    }
}

TEST(Simplify, LeavesASmallMeshAsItIs) {
  const TriangleMesh mesh = sphere(8);
  const TriangleMesh same = simplified(mesh, mesh.triangles.size());
  EXPECT_EQ(same.triangles.size(), mesh.triangles.size());
}

TEST(Simplify, IsDeterministic) {
  const TriangleMesh mesh = sphere(64);
  const TriangleMesh first = simplified(mesh, 300), second = simplified(mesh, 300);
  EXPECT_EQ(first.triangles, second.triangles);
  EXPECT_EQ(first.positions, second.positions);
}

} // namespace
} // namespace surflect
