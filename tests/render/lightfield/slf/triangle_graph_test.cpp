#include "render/lightfield/slf/triangle_graph.h"

#include "surfel/base/error.h"
#include "tests/render/lightfield/slf/meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

namespace surflect::slf {
namespace {

using namespace testing;

size_t openEdges(const TriangleGraph& graph) {
  size_t count = 0;
  for (const auto& neighbors : graph.neighbors)
    count += static_cast<size_t>(std::ranges::count(neighbors, kNoTriangle));
  return count;
}

std::string problemOf(const TriangleMesh& mesh) {
  try {
    triangleGraph(mesh);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(TriangleGraph, NeighborsOfAClosedMeshShareTheirEdgeTheOtherWay) {
  const TriangleMesh mesh = torus(7, 5);
  const TriangleGraph graph = triangleGraph(mesh);
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t other = graph.neighbors[t][k];
      ASSERT_NE(other, kNoTriangle);
      const auto back =
          static_cast<size_t>(std::ranges::find(graph.neighbors[other], t) - graph.neighbors[other].begin());
      ASSERT_LT(back, 3u);
      EXPECT_EQ(graph.corners[other][back], graph.corners[t][(k + 1) % 3]);
      EXPECT_EQ(graph.corners[other][(back + 1) % 3], graph.corners[t][k]);
    }
  EXPECT_EQ(std::ranges::count(graph.isPinched, 1), 0);
}

TEST(TriangleGraph, ABorderHasNoNeighbors) { EXPECT_EQ(openEdges(triangleGraph(squarePatch(5))), 20u); }

TEST(TriangleGraph, VerticesAtOnePositionAreOnePlace) {
  const TriangleMesh patch = squarePatch(3);
  TriangleMesh apart;
  for (const auto& triangle : patch.triangles) {
    const auto first = static_cast<uint32_t>(apart.positions.size());
    for (const uint32_t v : triangle) apart.positions.push_back(patch.positions[v]);
    apart.triangles.push_back({first, first + 1, first + 2});
  }
  EXPECT_EQ(triangleGraph(apart).neighbors, triangleGraph(patch).neighbors);
}

TEST(TriangleGraph, AnEdgeOfThreeTrianglesOrOfOppositeWindingsIsABorder) {
  const std::vector<Vec3<double>> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  EXPECT_EQ(openEdges(triangleGraph(meshOf(positions, {{0, 1, 2}, {1, 0, 3}}))), 4u);
  EXPECT_EQ(openEdges(triangleGraph(meshOf(positions, {{0, 1, 2}, {0, 1, 3}}))), 6u);
  EXPECT_EQ(openEdges(triangleGraph(meshOf(positions, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}))), 9u);
}

TEST(TriangleGraph, APlaceWhereFansTouchIsPinched) {
  const TriangleMesh mesh =
      meshOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 3, 4}});
  EXPECT_EQ(triangleGraph(mesh).isPinched, (std::vector<uint8_t>{1, 0, 0, 0, 0}));
}

TEST(TriangleGraph, UnsoundTrianglesAreRefused) {
  TriangleMesh mesh = squarePatch(1);
  mesh.triangles[1] = {0, 3, 4};
  EXPECT_EQ(problemOf(mesh), "triangles[1]: found 4, expected a vertex below 4");
  mesh.triangles[1] = {0, 3, 3};
  EXPECT_EQ(problemOf(mesh), "triangles[1]: has two corners at one place; expected a triangle with an area");
  mesh = squarePatch(1);
  mesh.positions[2] = {0, std::numeric_limits<float>::quiet_NaN(), 0};
  EXPECT_EQ(problemOf(mesh), "positions[2]: is not finite");
}

} // namespace
} // namespace surflect::slf
