#include "render/lightfield/slf/parametrization.h"

#include "render/lightfield/slf/regions.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/render/lightfield/slf/whole_disc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

using namespace testing;

TEST(PlaneArea, IsPositiveCounterClockwise) {
  EXPECT_EQ(planeArea({0, 0}, {2, 0}, {0, 1}), 1);
  EXPECT_EQ(planeArea({0, 0}, {0, 1}, {2, 0}), -1);
}

TEST(Stretch, SumsOfARectangle) {
  // A rectangle of 3 x 2 over the unit square.
  const std::vector<Vec3<double>> positions = {{0, 0, 0}, {3, 0, 0}, {3, 0, 2}, {0, 0, 2}};
  const std::vector<Vec2<double>> coordinates = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  std::vector<std::array<uint32_t, 3>> triangles = {{0, 1, 2}, {0, 2, 3}};
  StretchSums sums = stretchSums(positions, triangles, coordinates);
  EXPECT_DOUBLE_EQ(sums.a, 6 * 9);
  EXPECT_DOUBLE_EQ(sums.c, 6 * 4);
  EXPECT_DOUBLE_EQ(sums.area, 6);
  EXPECT_DOUBLE_EQ(sums.planeArea, 1);
  EXPECT_DOUBLE_EQ(sums.bestAspect(), 1.5);
  EXPECT_DOUBLE_EQ(sums.leastStretch(), 2 * 6 * 6); // 2 area^2: no stretch
  triangles[1] = {0, 3, 2};
  sums = stretchSums(positions, triangles, coordinates);
  EXPECT_TRUE(std::isinf(sums.leastStretch()));
}

TEST(Stretch, LeastStretchIsThatOfTheBestAspect) {
  const StretchSums sums{5, 0.7, 1, 1};
  const auto stretchAt = [&](double aspect) { return sums.a / aspect + sums.c * aspect; };
  EXPECT_NEAR(sums.leastStretch(), stretchAt(sums.bestAspect()), 1e-12);
  EXPECT_LT(sums.leastStretch(), stretchAt(sums.bestAspect() * 1.01));
  EXPECT_LT(sums.leastStretch(), stretchAt(sums.bestAspect() / 1.01));
}

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

TEST(SquareBorder, IsStrictlyConvexWithinTheSquareAndTouchesItsSides) {
  const Disc disc = wholeOf(shaken(squarePatch(9), 0.03f, 1));
  const size_t n = disc.border.size();
  for (const SquareShape& shape : {SquareShape{0.02, 0}, SquareShape{0.02, 1}, SquareShape{0.15, 0.5}}) {
    const std::vector<Vec2<double>> p = squareBorder(disc, {3, 10, 20, 31}, shape);
    double area = 0;
    for (size_t i = 0; i < n; ++i) {
      EXPECT_GT(planeArea(p[i], p[(i + 1) % n], p[(i + 2) % n]), 0);
      EXPECT_TRUE((p[i].array() >= 0).all() && (p[i].array() <= 1).all());
      area += planeArea({0, 0}, p[i], p[(i + 1) % n]);
    }
    const double s = shape.bulge, inner = 1 - 2 * s;
    const double exact = inner * inner + 4 * 2.0 / 3 * s * inner; // with a parabola on each side
    EXPECT_LT(area, exact);
    EXPECT_GT(area, exact - 0.02 * s * 4);
    EXPECT_LT((p[3] - Vec2<double>(s, s)).norm(), 1e-15);
    EXPECT_LT((p[20] - Vec2<double>(1 - s, 1 - s)).norm(), 1e-15);
  }
}

TEST(SquareBorder, IsStrictlyConvexUpToABulgeOfASixth) {
  const Disc disc = wholeOf(squarePatch(200));
  const size_t n = disc.border.size();
  for (const double bulge : {1e-3, 0.1, 0.165}) {
    const std::vector<Vec2<double>> p = squareBorder(disc, {0, 200, 400, 600}, {bulge});
    for (size_t i = 0; i < n; ++i) EXPECT_GT(planeArea(p[i], p[(i + 1) % n], p[(i + 2) % n]), 0) << bulge;
  }
  // Beside a corner, the border turns less and less.
  const auto turnAtCorner = [&](double bulge) {
    const std::vector<Vec2<double>> p = squareBorder(disc, {0, 200, 400, 600}, {bulge});
    return planeArea(p[199], p[200], p[201]) / ((p[200] - p[199]).norm() * (p[201] - p[200]).norm());
  };
  EXPECT_GT(turnAtCorner(0.02), 0.45);
  EXPECT_LT(turnAtCorner(0.165), 0.02);
}

TEST(SquareBorder, SpacesVerticesByTheirDistances) {
  const Disc disc = wholeOf(shaken(squarePatch(9), 0.03f, 1));
  const std::vector<Vec2<double>> p = squareBorder(disc, {0, 9, 18, 27});
  const auto length = [&](size_t from, size_t to) {
    double sum = 0;
    for (size_t i = from; i < to; ++i)
      sum += (disc.positions[disc.border[i + 1]] - disc.positions[disc.border[i]]).norm();
    return sum;
  };
  for (size_t i = 0; i < 9; ++i) EXPECT_NEAR((p[i].x() - 0.02) / 0.96, length(0, i) / length(0, 9), 1e-12);
}

double leastStretchOf(const Parametrization& map) { // 1 without stretch
  return map.stretch.leastStretch() / (2 * map.stretch.area * map.stretch.area);
}

TEST(Parametrization, IsOneToOneWithinTheSquareForEveryRoughness) {
  for (const TriangleMesh& mesh : {shaken(squarePatch(9), 0.02f, 1), squarePatch(1)}) {
    const Disc disc = wholeOf(mesh);
    for (int roughness = 0; roughness <= kRoughest; ++roughness) {
      const Parametrization map = parametrizationOf(disc, roughness);
      EXPECT_TRUE(std::isfinite(leastStretchOf(map))) << roughness;
      for (const Vec2<double>& p : map.coordinates)
        EXPECT_TRUE((p.array() > -1e-12).all() && (p.array() < 1 + 1e-12).all());
    }
  }
}

TEST(Parametrization, RougherMapsHaveMoreStretch) {
  const Disc disc = wholeOf(shaken(squarePatch(9), 0.02f, 1));
  double before = 1;
  for (int roughness = 0; roughness <= kRoughest; ++roughness) {
    const double now = leastStretchOf(parametrizationOf(disc, roughness));
    EXPECT_GT(now, before) << roughness;
    before = now;
  }
}

TEST(Parametrization, ATriangleKeepsItsShape) {
  // Longest edge 5, height 2.4, foot of the height 1.8 from the corner (0, 3).
  const Disc disc = wholeOf(meshOf({{0, 0, 0}, {4, 0, 0}, {0, 3, 0}}, {{0, 1, 2}}));
  const Parametrization map = parametrizationOf(disc);
  EXPECT_NEAR(leastStretchOf(map), 2, 1e-9); // of half of its rectangle
  EXPECT_NEAR(map.stretch.bestAspect(), 5 / 2.4, 1e-6);
}

} // namespace
} // namespace surflect::slf
