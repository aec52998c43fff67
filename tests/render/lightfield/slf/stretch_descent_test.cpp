#include "render/lightfield/slf/stretch_descent.h"

#include "render/lightfield/slf/convex_map.h"
#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/plane_border.h"
#include "render/lightfield/slf/square_border.h"
#include "render/lightfield/slf/stretch.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/render/lightfield/slf/whole_disc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::slf {
namespace {

using namespace testing;

std::vector<Vec2<double>> convexMapOf(const Disc& disc) {
  const size_t n = disc.border.size();
  return ConvexMap(disc, MeanWeights::meanValue)(squareBorder(disc, {0, n / 4, n / 2, 3 * n / 4}));
}

double stretchOf(const Disc& disc, const std::vector<Vec2<double>>& coordinates) {
  const StretchSums sums = stretchSums(disc.positions, disc.triangles, coordinates);
  return sums.leastStretch() / (2 * sums.area * sums.area); // 1 without stretch
}

// Upper part of the bumpy sphere, with a ragged border.
TriangleMesh cap(double bump) {
  TriangleMesh mesh = bumpySphere(30, 31, bump);
  std::erase_if(mesh.triangles, [&](const auto& triangle) {
    return std::ranges::any_of(triangle, [&](uint32_t v) { return mesh.positions[v].z() < 0.3f; });
  });
  return mesh;
}

TEST(StretchDescent, AFlatPatchLosesAllStretch) {
  const Disc disc = wholeOf(squarePatch(8));
  std::vector<Vec2<double>> coordinates = convexMapOf(disc); // bulged
  EXPECT_GT(stretchOf(disc, coordinates), 1.01);
  lowerStretch(disc, coordinates, {.mostSweeps = 2000, .leastGain = 1e-9});
  EXPECT_NEAR(stretchOf(disc, coordinates), 1, 1e-5);
}

TEST(StretchDescent, StretchFallsAndTheMapStaysOneToOneWithinTheSquare) {
  for (const double bump : {0.0, 0.2, 0.4}) {
    const Disc disc = wholeOf(shaken(cap(bump), 0.01f, 1));
    std::vector<Vec2<double>> coordinates = convexMapOf(disc);
    double before = stretchOf(disc, coordinates);
    ASSERT_TRUE(std::isfinite(before));
    for (int i = 0; i < 10; ++i) {
      lowerStretch(disc, coordinates, {.mostSweeps = 4, .leastGain = 0});
      const double now = stretchOf(disc, coordinates);
      EXPECT_LT(now, before); // infinite where a triangle is not positive
      before = now;
      std::vector<Vec2<double>> border;
      for (const uint32_t v : disc.border) border.push_back(coordinates[v]);
      EXPECT_FALSE(crossesItself(border));
      for (const Vec2<double>& p : coordinates)
        EXPECT_TRUE((p.array() > -1e-12).all() && (p.array() < 1 + 1e-12).all());
    }
  }
}

TEST(StretchDescent, TrianglesWithoutAreaStayPositive) {
  TriangleMesh mesh = squarePatch(8);
  for (size_t v = 10; v < mesh.positions.size(); v += 4) { // onto the row below
    const auto& p = mesh.positions[v];
    mesh.positions[v] = {p.x() + 0.04f, p.y() - 0.125f, 0};
  }
  const Disc disc = wholeOf(mesh);
  std::vector<Vec2<double>> coordinates = convexMapOf(disc);
  lowerStretch(disc, coordinates);
  for (const auto& [i, j, k] : disc.triangles)
    EXPECT_GT(planeArea(coordinates[i], coordinates[j], coordinates[k]), 1e-8);
}

} // namespace
} // namespace surflect::slf
