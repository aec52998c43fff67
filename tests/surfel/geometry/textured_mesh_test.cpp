#include "surfel/geometry/textured_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace surflect {
namespace {

using Polygon = std::vector<Vec3<double>>;
using Triangles = std::vector<std::array<uint32_t, 3>>;
constexpr double kPi = std::numbers::pi;

Triangles triangulated(const Polygon& polygon) {
  Triangles triangles;
  appendTriangles(polygon, triangles);
  return triangles;
}

Polygon inPlane(const std::vector<std::pair<double, double>>& corners) {
  Polygon polygon;
  for (const auto& [x, y] : corners) polygon.emplace_back(static_cast<float>(x), static_cast<float>(y), 0);
  return polygon;
}

double shoelace(const Polygon& polygon) {
  double area = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const auto &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    area += (p.x() * q.y() - q.x() * p.y()) / 2;
  }
  return area;
}

// By the winding of the polygon's sides around the point.
bool isInside(const Polygon& polygon, double x, double y) {
  bool inside = false;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const auto &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    if ((p.y() > y) != (q.y() > y) && x < p.x() + (y - p.y()) / (q.y() - p.y()) * (q.x() - p.x()))
      inside = !inside;
  }
  return inside;
}

// The laws of a triangulation, of a counter-clockwise polygon in the plane z = 0.
void expectCovered(const Polygon& polygon) {
  const Triangles triangles = triangulated(polygon);
  ASSERT_EQ(triangles.size(), polygon.size() - 2);
  double sum = 0;
  for (const auto& [a, b, c] : triangles) {
    const double area = (polygon[b] - polygon[a]).cross(polygon[c] - polygon[a]).z() / 2;
    EXPECT_GE(area, 0) << a << ' ' << b << ' ' << c;
    sum += area;
    const Vec3<double> middle = (polygon[a] + polygon[b] + polygon[c]) / 3;
    EXPECT_TRUE(area < 1e-9 || isInside(polygon, middle.x(), middle.y())) << a << ' ' << b << ' ' << c;
  }
  EXPECT_NEAR(sum, shoelace(polygon), 1e-12 * sum);
  // Each side belongs to one triangle, every other edge to two: nothing gapes.
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (const auto& t : triangles)
    for (size_t k = 0; k < 3; ++k) {
      ++edges[{t[k], t[(k + 1) % 3]}];
      --edges[{t[(k + 1) % 3], t[k]}];
    }
  const auto n = static_cast<uint32_t>(polygon.size());
  for (uint32_t i = 0; i < n; ++i) {
    --edges[{i, (i + 1) % n}];
    ++edges[{(i + 1) % n, i}];
  }
  for (const auto& [edge, count] : edges) EXPECT_EQ(count, 0) << edge.first << ' ' << edge.second;
}

// From every first corner.
void expectCoveredFromAnyCorner(Polygon polygon) {
  for (size_t i = 0; i < polygon.size(); ++i) {
    std::ranges::rotate(polygon, polygon.begin() + 1);
    expectCovered(polygon);
  }
}

Polygon star(int points, double inner) {
  std::vector<std::pair<double, double>> corners;
  for (int i = 0; i < 2 * points; ++i) {
    const double radius = i % 2 ? inner : 1, angle = kPi * i / points;
    corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return inPlane(corners);
}

Polygon comb(int teeth) {
  std::vector<std::pair<double, double>> corners = {{0, 0}, {2.0 * teeth, 0}};
  for (int i = teeth; i-- > 0;) {
    corners.insert(corners.end(), {{2 * i + 2, 5}, {2 * i + 1.25, 5}, {2 * i + 1.25, 1}});
    if (i > 0) corners.emplace_back(2 * i, 1);
  }
  corners.emplace_back(0, 1);
  return inPlane(corners);
}

Polygon spiral(int steps) {
  std::vector<std::pair<double, double>> corners;
  const auto add = [&](int i, double gap) {
    const double angle = kPi / 5 * i, radius = 0.2 + 0.1 * i + gap;
    corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  };
  for (int i = 0; i < steps; ++i) add(i, 0.3);
  for (int i = steps; i-- > 0;) add(i, -0.1);
  return inPlane(corners);
}

TEST(EarClipping, ConvexPolygonsBecomeFans) {
  Polygon polygon;
  for (int i = 0; i < 9; ++i)
    polygon.emplace_back(std::cos(2 * kPi * i / 9), std::sin(2 * kPi * i / 9), 0.01 * (i % 2)); // nearly flat
  const Triangles triangles = triangulated(polygon);
  for (uint32_t i = 0; i < 7; ++i) EXPECT_EQ(triangles[i], (std::array{0u, i + 1, i + 2}));
  // Corners on its sides: as many triangles, some of no area.
  EXPECT_EQ(triangulated(inPlane({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}})),
            (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(EarClipping, TrianglesCoverThePolygonAndNothingElse) {
  expectCoveredFromAnyCorner(inPlane({{0, 0}, {2, 0}, {2, 2}, {1, 0.5}})); // a dart
  expectCoveredFromAnyCorner(
      inPlane({{-1, -1}, {1, -1}, {1, -0.5}, {-0.5, -0.5}, {-0.5, 0.5}, {1, 0.5}, {1, 1}, {-1, 1}})); // a C
  expectCoveredFromAnyCorner(star(7, 0.2));
  expectCoveredFromAnyCorner(comb(6));
  expectCoveredFromAnyCorner(spiral(20));
}

TEST(EarClipping, TrianglesCoverRandomPolygons) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0.05, 1);
  for (int trial = 0; trial < 200; ++trial) { // stars around the origin, of any radius at growing angles
    const int n = 4 + trial % 40;
    std::vector<std::pair<double, double>> corners;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * kPi * (i + 0.9 * share(random)) / n, radius = share(random);
      corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    expectCovered(inPlane(corners));
  }
}

TEST(EarClipping, CornersOnALineAndAtOnePlaceLeaveNoGap) {
  // An L with a corner in the middle of every side.
  expectCoveredFromAnyCorner(inPlane({{0, 0},
                                      {1, 0},
                                      {2, 0},
                                      {2, 0.5},
                                      {2, 1},
                                      {1.5, 1},
                                      {1, 1},
                                      {1, 1.5},
                                      {1, 2},
                                      {0.5, 2},
                                      {0, 2},
                                      {0, 1}}));
  // A corner of the C twice.
  expectCoveredFromAnyCorner(inPlane(
      {{-1, -1}, {1, -1}, {1, -0.5}, {-0.5, -0.5}, {-0.5, -0.5}, {-0.5, 0.5}, {1, 0.5}, {1, 1}, {-1, 1}}));
  // A square with square holes, each joined to the outline by a seam that is gone along twice.
  expectCoveredFromAnyCorner(
      inPlane({{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}}));
  expectCoveredFromAnyCorner(inPlane({{0, 0},
                                      {7, 0},
                                      {7, 3},
                                      {5, 2},
                                      {6, 2},
                                      {6, 1},
                                      {5, 1},
                                      {5, 2},
                                      {7, 3},
                                      {0, 3},
                                      {0, 0},
                                      {1, 1},
                                      {1, 2},
                                      {2, 2},
                                      {2, 1},
                                      {1, 1}}));
}

TEST(EarClipping, APolygonMayLieAnyhowAndBeAlmostFlat) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  const double rounding = std::sqrt(3.0) * std::ldexp(1, -21); // of corners whose coordinates are below 16
  for (int trial = 0; trial < 50; ++trial) {
    const Polygon flat = comb(4);
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
    Polygon polygon;
    for (const auto& p : flat)
      polygon.push_back((turn * Vec3<double>(p.x(), p.y(), 0.01 * normal(random)) + Vec3<double>(5, -3, 8))
                            .cast<float>()
                            .cast<double>());
    double sum = 0;
    const Vec3<double> up = turn * Vec3<double>::UnitZ();
    for (const auto& [a, b, c] : triangulated(polygon)) {
      const Vec3<double> ab = polygon[b] - polygon[a], ac = polygon[c] - polygon[a];
      const double area = ab.cross(ac).dot(up) / 2;
      EXPECT_GT(area, -rounding * (ab.norm() + ac.norm())); // rounded corners on a line
      sum += area;
    }
    EXPECT_NEAR(sum, shoelace(flat), 1e-5 * sum);
  }
}

TEST(EarClipping, TrianglesCoverPolygonsOfAThousandCorners) {
  expectCovered(spiral(600));
  expectCovered(comb(300));
}

TEST(EarClipping, PolygonsThatCrossThemselvesGetAsManyTriangles) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    Polygon polygon;
    for (int i = 0; i < 4 + trial % 20; ++i)
      polygon.emplace_back(place(random), place(random), trial % 2 ? place(random) : 0);
    if (trial % 3 == 0) polygon[2] = polygon[0];
    const Triangles triangles = triangulated(polygon);
    ASSERT_EQ(triangles.size(), polygon.size() - 2);
    for (const auto& triangle : triangles)
      for (const uint32_t corner : triangle) ASSERT_LT(corner, polygon.size());
  }
  const Polygon nowhere(6, Vec3<double>(1, 2, 3));
  EXPECT_EQ(triangulated(nowhere).size(), 4u);
}

} // namespace
} // namespace surflect
