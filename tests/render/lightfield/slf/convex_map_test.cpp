#include "render/lightfield/slf/convex_map.h"

#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/regions.h"
#include "render/lightfield/slf/square_border.h"
#include "render/lightfield/slf/stretch.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/render/lightfield/slf/whole_disc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

using namespace testing;

SquareCorners quarters(const Disc& disc) {
  const size_t n = disc.border.size();
  return {0, n / 4, n / 2, 3 * n / 4};
}

double leastArea(const Disc& disc, const std::vector<Vec2<double>>& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [i, j, k] : disc.triangles) least = std::min(least, planeArea(p[i], p[j], p[k]));
  return least;
}

// Patch whose inner vertices are moved within the plane, without folds.
TriangleMesh unevenPatch(uint32_t n, unsigned seed) {
  TriangleMesh mesh = squarePatch(n);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> move(-0.2f / static_cast<float>(n), 0.2f / static_cast<float>(n));
  for (auto& p : mesh.positions) p = {p.x() + move(random), p.y() + move(random), 0};
  return mesh;
}

TEST(ConvexMap, MeanValuesReproduceAPlaneDisc) {
  // [Floater 2003]: mean value coordinates have linear precision.
  const Disc disc = wholeOf(unevenPatch(9, 1));
  const auto image = [](const Vec3<double>& q) {
    return Vec2<double>(2 * q.x() - q.y() + 1, q.x() + 3 * q.y());
  };
  std::vector<Vec2<double>> border;
  for (const uint32_t v : disc.border) border.push_back(image(disc.positions[v]));
  const std::vector<Vec2<double>> map = ConvexMap(disc, MeanWeights::meanValue)(border);
  for (size_t v = 0; v < map.size(); ++v) EXPECT_LT((map[v] - image(disc.positions[v])).norm(), 1e-12);
}

TEST(ConvexMap, UniformWeightsPutVerticesAtTheMeanOfTheirNeighbors) {
  const Disc disc = wholeOf(shaken(squarePatch(6), 0.05f, 1));
  const std::vector<Vec2<double>> map =
      ConvexMap(disc, MeanWeights::uniform)(squareBorder(disc, quarters(disc)));
  std::vector<Vec2<double>> sums(map.size(), Vec2<double>::Zero());
  std::vector<double> counts(map.size(), 0);
  for (const auto& triangle : disc.triangles)
    for (size_t k = 0; k < 3; ++k) {
      // Around an inner vertex each neighbour is in two triangles.
      sums[triangle[k]] += map[triangle[(k + 1) % 3]] + map[triangle[(k + 2) % 3]];
      counts[triangle[k]] += 2;
    }
  for (uint32_t v = 0; v < map.size(); ++v) {
    const bool isInner = std::ranges::count(disc.border, v) == 0;
    if (!isInner) continue;
    EXPECT_LT((sums[v] / counts[v] - map[v]).norm(), 1e-14);
  }
}

TEST(ConvexMap, IsOneToOneForBothWeights) {
  const TriangleMesh mesh = shaken(bumpySphere(30, 31, 0.2), 0.02f, 1);
  const TriangleGraph graph = triangleGraph(mesh);
  for (const std::vector<uint32_t>& triangles : regionsOf(mesh, {.regions = 12}).triangles()) {
    const Disc disc = discOf(mesh, graph, triangles).value();
    for (const MeanWeights weights : {MeanWeights::meanValue, MeanWeights::uniform})
      EXPECT_GT(leastArea(disc, ConvexMap(disc, weights)(squareBorder(disc, quarters(disc)))), 0);
  }
}

TEST(ConvexMap, TrianglesWithoutAreaKeepAnAreaInThePlane) {
  TriangleMesh mesh = squarePatch(8);
  for (size_t v = 0; v < mesh.positions.size(); v += 3) { // onto the line to the next vertex
    const auto& p = mesh.positions[v];
    if (p.x() > 0 && p.x() < 1 && p.y() > 0 && p.y() < 1) mesh.positions[v] = {p.x() + 0.05f, p.y(), 0};
  }
  mesh.positions[40] = {mesh.positions[31].x(), mesh.positions[31].y() + 1e-6f, 0};
  const Disc disc = wholeOf(mesh);
  for (const MeanWeights weights : {MeanWeights::meanValue, MeanWeights::uniform})
    EXPECT_GT(leastArea(disc, ConvexMap(disc, weights)(squareBorder(disc, quarters(disc)))), 0);
}

TEST(ConvexMap, ADiscWithoutInnerVerticesIsItsBorder) {
  const Disc disc = wholeOf(squarePatch(1));
  const std::vector<Vec2<double>> border = squareBorder(disc, {0, 1, 2, 3});
  const std::vector<Vec2<double>> map = ConvexMap(disc, MeanWeights::meanValue)(border);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(map[disc.border[i]], border[i]);
}

} // namespace
} // namespace surflect::slf
