#include "render/lightfield/olf/delaunay.h"

#include "render/lightfield/lfm/view_blend.h"
#include "tests/support/random.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surflect::olf {
namespace {

using lfm::DiscPoint;

std::vector<DiscPoint> randomSites(std::mt19937& random, size_t count, double size = 1) {
  std::uniform_real_distribution<double> place(-size, size);
  std::vector<DiscPoint> sites;
  for (size_t i = 0; i < count; ++i) {
    const double x = place(random);
    sites.emplace_back(x, place(random));
  }
  return sites;
}

// Photographs of a turntable as a point near its axis sees them: on circles, nearly.
std::vector<DiscPoint> rings(double offset) {
  std::vector<DiscPoint> sites;
  for (const double radius : {0.2, 0.35, 0.55, 0.8})
    for (int k = 0; k < 36; ++k) {
      const double angle = 2 * std::numbers::pi * k / 36;
      sites.emplace_back(radius * std::cos(angle) + offset * radius * radius, radius * std::sin(angle));
    }
  return sites;
}

std::vector<std::array<uint32_t, 3>> sortedCorners(std::span<const DelaunayTriangle> triangles) {
  std::vector<std::array<uint32_t, 3>> all;
  for (const auto& [corners, neighbors] : triangles) {
    all.push_back(corners);
    std::rotate(all.back().begin(), std::ranges::min_element(all.back()), all.back().end());
  }
  std::ranges::sort(all);
  return all;
}

double areaOf(std::span<const DiscPoint> sites, std::span<const std::array<uint32_t, 3>> triangles) {
  double sum = 0;
  for (const auto& [a, b, c] : triangles) sum += lfm::doubledArea(sites[a], sites[b], sites[c]) / 2;
  return sum;
}

// How far a site is within the circumcircle of a triangle, relative to its radius; at most 0 for Delaunay's.
double mostWithin(std::span<const DiscPoint> sites, std::span<const DelaunayTriangle> triangles) {
  double most = -1;
  for (const auto& [corners, neighbors] : triangles) {
    const DiscPoint a = sites[corners[0]], u = sites[corners[1]] - a, v = sites[corners[2]] - a;
    const double area = u[0] * v[1] - u[1] * v[0];
    const DiscPoint center(a[0] + (v[1] * u.squaredNorm() - u[1] * v.squaredNorm()) / (2 * area),
                           a[1] + (u[0] * v.squaredNorm() - v[0] * u.squaredNorm()) / (2 * area));
    const double radius = (a - center).norm();
    if (radius > 1e3) continue; // a sliver at the border, whose circle is uncertain
    for (const DiscPoint& site : sites) most = std::max(most, 1 - (site - center).norm() / radius);
  }
  return most;
}

void expectNeighborsMeetAtEdges(std::span<const DelaunayTriangle> triangles) {
  for (uint32_t t = 0; t < triangles.size(); ++t)
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t across = triangles[t].neighbors[i];
      if (across == DelaunayTriangle::kNone) continue;
      ASSERT_LT(across, triangles.size());
      const auto& [corners, neighbors] = triangles[across];
      const auto back = static_cast<size_t>(std::ranges::find(neighbors, t) - neighbors.begin());
      ASSERT_LT(back, 3u);
      EXPECT_EQ(corners[(back + 1) % 3], triangles[t].corners[(i + 2) % 3]);
      EXPECT_EQ(corners[(back + 2) % 3], triangles[t].corners[(i + 1) % 3]);
    }
}

TEST(Delaunay, HasTheTrianglesOfQhull) {
  std::mt19937 random(5);
  for (size_t count = 3; count < 300; count += 1 + count / 8)
    for (const double size : {1.0, 300.0}) {
      const std::vector<DiscPoint> sites = randomSites(random, count, size);
      const std::vector<DelaunayTriangle> triangles = delaunay(sites);
      expectNeighborsMeetAtEdges(triangles);
      if (size == 1)
        EXPECT_EQ(sortedCorners(triangles), lfm::delaunayTriangles(sites)) << count;
      else
        EXPECT_LE(mostWithin(sites, triangles), 1e-10) << count;
    }
}

TEST(Delaunay, SitesOnCirclesAreTriangulatedOnce) {
  for (const double offset : {0.0, 1e-15, 1e-12, 1e-6, 0.1}) {
    const std::vector<DiscPoint> sites = rings(offset);
    const std::vector<DelaunayTriangle> triangles = delaunay(sites);
    expectNeighborsMeetAtEdges(triangles);
    EXPECT_LE(mostWithin(sites, triangles), 1e-12) << offset;
    EXPECT_NEAR(areaOf(sites, sortedCorners(triangles)), areaOf(sites, lfm::delaunayTriangles(sites)), 1e-12);
  }
}

TEST(Delaunay, EqualSitesAreLeftOut) {
  std::mt19937 random(6);
  std::vector<DiscPoint> sites = randomSites(random, 50);
  const double area = areaOf(sites, sortedCorners(delaunay(sites)));
  for (size_t i = 0; i < 50; ++i) sites.push_back(sites[i]);
  const std::vector<DelaunayTriangle> triangles = delaunay(sites);
  expectNeighborsMeetAtEdges(triangles);
  EXPECT_NEAR(areaOf(sites, sortedCorners(triangles)), area, 1e-12);
  EXPECT_LE(mostWithin(sites, triangles), 1e-12);
}

TEST(Delaunay, AGridHasTwoTrianglesOfEachCell) {
  std::vector<DiscPoint> sites;
  for (int j = 0; j < 9; ++j)
    for (int i = 0; i < 9; ++i) sites.emplace_back(0.1 * i, 0.1 * j);
  const std::vector<DelaunayTriangle> triangles = delaunay(sites);
  EXPECT_EQ(triangles.size(), 2u * 64);
  EXPECT_NEAR(areaOf(sites, sortedCorners(triangles)), 0.64, 1e-12);
  expectNeighborsMeetAtEdges(triangles);
}

TEST(Delaunay, OfALineThereAreNone) {
  std::vector<DiscPoint> sites;
  for (int i = 0; i < 9; ++i) sites.emplace_back(0.1 * i, 0.07 * i);
  EXPECT_TRUE(delaunay(sites).empty());
  EXPECT_TRUE(delaunay({sites.data(), 2}).empty());
  EXPECT_TRUE(delaunay({}).empty());
  EXPECT_TRUE(delaunay(std::vector<DiscPoint>(5, DiscPoint(0.3, 0.4))).empty());
}

} // namespace
} // namespace surflect::olf
