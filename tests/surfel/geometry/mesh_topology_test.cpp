#include "surfel/geometry/mesh_topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace surflect {
namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

TriangleMesh meshWith(const std::vector<Vec3<float>>& positions, Triangles triangles) {
  TriangleMesh mesh{{}, std::move(triangles)};
  for (const auto& p : positions) mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p));
  return mesh;
}

// Outwards.
TriangleMesh tetrahedron() {
  return meshWith({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});
}

// Every corner a vertex of its own.
TriangleMesh apart(const TriangleMesh& mesh) {
  TriangleMesh result;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<uint32_t>(result.positions.size());
    for (const uint32_t corner : triangle) result.positions.push_back(mesh.positions[corner]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

TEST(MeshTopology, VerticesAtOnePlaceAreOne) {
  const TriangleMesh mesh = meshWith({{0, 0, 0}, {1, 2, 3}, {-0.f, 0, 0}, {1, 2, 3}, {1, 2, 4}}, {});
  EXPECT_EQ(firstAtPlace(mesh), (std::vector<uint32_t>{0, 1, 0, 1, 4}));
}

TEST(MeshTopology, CopiesAndBacksAreToldApart) {
  TriangleMesh mesh = apart(tetrahedron());
  mesh.triangles.insert(mesh.triangles.end(), {{1, 2, 0}, {5, 4, 3}, {3, 5, 4}, {3, 4, 5}});
  const Repeats repeats = repeatsIn(mesh);
  EXPECT_EQ(repeats.first, (std::vector<uint32_t>{0, 1, 2, 3, 0, 1, 1, 1}));
  EXPECT_EQ(repeats.isBack, (std::vector<uint8_t>{0, 0, 0, 0, 0, 1, 0, 0}));
  EXPECT_TRUE(repeats.isCopy(4));
  EXPECT_FALSE(repeats.isCopy(5));
  EXPECT_TRUE(repeats.isCopy(6)); // a second back
}

TEST(MeshTopology, TrianglesWoundAgainstMostOfTheirPartAreFound) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    TriangleMesh mesh = apart(tetrahedron());
    const size_t against = random() % 4; // none has half of the area
    std::swap(mesh.triangles[against][0], mesh.triangles[against][1]);
    const MeshParts parts = partsOf(mesh);
    ASSERT_EQ(parts.parts.size(), 1u);
    EXPECT_TRUE(parts.parts[0].isOrientable);
    for (size_t t = 0; t < 4; ++t) EXPECT_EQ(parts.isAgainst[t], t == against);
  }
  EXPECT_EQ(partsOf(tetrahedron()).isAgainst, (std::vector<uint8_t>{0, 0, 0, 0}));
}

TEST(MeshTopology, PartsHangTogetherOverEdgesOfTwoTriangles) {
  // Two triangles share an edge, a third touches in a corner; three share another edge.
  const TriangleMesh mesh = meshWith({{0, 0, 0},
                                      {1, 0, 0},
                                      {0, 1, 0},
                                      {1, 1, 0},
                                      {2, 2, 0},
                                      {2, 1, 0},
                                      {5, 0, 0},
                                      {6, 0, 0},
                                      {5, 1, 0},
                                      {5, -1, 0},
                                      {5, 0, 1}},
                                     {{0, 1, 2}, {1, 3, 2}, {3, 5, 4}, {6, 7, 8}, {7, 6, 9}, {6, 7, 10}});
  const MeshParts parts = partsOf(mesh);
  ASSERT_EQ(parts.parts.size(), 5u);
  EXPECT_EQ(parts.parts[0].triangles, (std::vector<uint32_t>{0, 1}));
  EXPECT_DOUBLE_EQ(parts.parts[0].area, 1);
  EXPECT_EQ(parts.parts[0].box.max(), Vec3<double>(1, 1, 0));
}

TEST(MeshTopology, AMoebiusStripIsLeftAsItIs) {
  const auto strip = [](bool twisted) {
    std::vector<Vec3<float>> positions;
    Triangles triangles;
    constexpr uint32_t n = 12;
    for (uint32_t i = 0; i < n; ++i) {
      const float angle = 6.2831853f * static_cast<float>(i) / n, tilt = twisted ? angle / 2 : 0;
      for (const float side : {-0.3f, 0.3f}) {
        const float radius = 1 + side * std::cos(tilt);
        positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), side * std::sin(tilt));
      }
      uint32_t a = 2 * i, b = a + 1, c = (a + 2) % (2 * n), d = (a + 3) % (2 * n);
      if (twisted && i + 1 == n) std::swap(c, d);
      triangles.insert(triangles.end(), {{a, b, c}, {c, b, d}});
    }
    return meshWith(positions, triangles);
  };
  EXPECT_TRUE(partsOf(strip(false)).parts[0].isOrientable);
  const MeshParts parts = partsOf(strip(true));
  ASSERT_EQ(parts.parts.size(), 1u);
  EXPECT_FALSE(parts.parts[0].isOrientable);
  EXPECT_EQ(std::ranges::count(parts.isAgainst, 1), 0);
}

} // namespace
} // namespace surflect
