#include "render/lightfield/lfm/view_blend.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::lfm {
namespace {

using Sites = std::vector<DiscPoint>;

Sites randomSites(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1), azimuth(0, 2 * std::numbers::pi);
  Sites sites;
  for (size_t i = 0; i < count; ++i) {
    const double radius = 0.5 * std::sqrt(share(random)), phi = azimuth(random);
    sites.emplace_back(0.5 + radius * std::cos(phi), 0.5 + radius * std::sin(phi));
  }
  return sites;
}

Sites circle(size_t count) {
  Sites sites;
  for (size_t i = 0; i < count; ++i) {
    const double phi = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    sites.emplace_back(0.5 + 0.4 * std::cos(phi), 0.5 + 0.4 * std::sin(phi));
  }
  return sites;
}

// Scattered, on a circle, on a grid, on a line, equal, two, and one.
std::vector<Sites> siteSets() {
  std::vector<Sites> sets{randomSites(60, 1), randomSites(3, 2), circle(24)};
  Sites grid, line;
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) grid.emplace_back(0.2 + 0.15 * i, 0.2 + 0.15 * j);
    line.emplace_back(0.2 + 0.1 * i, 0.3 + 0.05 * i);
  }
  sets.insert(sets.end(), {grid, line, Sites(4, DiscPoint(0.3, 0.6)),
                           Sites{DiscPoint(0.2, 0.2), DiscPoint(0.7, 0.4)}, Sites{DiscPoint(0.6, 0.3)}});
  return sets;
}

std::vector<CellBlend> blendsOf(const Sites& sites, const ViewGrid& grid) {
  return cellBlends(siteMesh(sites), sites, grid);
}

DiscPoint blended(const CellBlend& blend, const Sites& sites) {
  DiscPoint sum = DiscPoint::Zero();
  for (size_t k = 0; k < 3; ++k) sum += static_cast<double>(blend.weights[k]) * sites[blend.sites[k]];
  return sum;
}

double cross(const DiscPoint& a, const DiscPoint& b) { return a[0] * b[1] - a[1] * b[0]; }

// Nearest point of the hull of all sites: inside any three of them, or on the segment between two.
DiscPoint nearestInHull(const DiscPoint& p, const Sites& sites) {
  double least = std::numeric_limits<double>::infinity();
  DiscPoint nearest = p;
  for (const DiscPoint& a : sites)
    for (const DiscPoint& b : sites) {
      const double length = (b - a).squaredNorm();
      const double share = length > 0 ? std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) : 0;
      const DiscPoint q = a + share * (b - a);
      if ((p - q).squaredNorm() < least) least = (p - q).squaredNorm(), nearest = q;
      for (const DiscPoint& c : sites)
        if (cross(b - a, p - a) >= 0 && cross(c - b, p - b) >= 0 && cross(a - c, p - c) >= 0 &&
            cross(b - a, c - a) > 0)
          return p;
    }
  return nearest;
}

TEST(ViewBlend, WeightsAreNotNegativeAndSumToOne) {
  const ViewGrid grid(16);
  for (const Sites& sites : siteSets()) {
    const std::vector<CellBlend> blends = blendsOf(sites, grid);
    ASSERT_EQ(blends.size(), grid.cells());
    for (const CellBlend& blend : blends) {
      EXPECT_GE(*std::ranges::min_element(blend.weights), 0);
      EXPECT_NEAR(blend.weights[0] + blend.weights[1] + blend.weights[2], 1, 2e-7);
      for (const uint32_t site : blend.sites) EXPECT_LT(site, sites.size());
    }
  }
}

TEST(ViewBlend, ALinearFunctionHasItsValueAtTheNearestPointOfTheHull) {
  const ViewGrid grid(8);
  for (const Sites& sites : siteSets()) {
    const std::vector<CellBlend> blends = blendsOf(sites, grid);
    for (size_t cell = 0; cell < grid.cells(); ++cell) {
      const DiscPoint center = grid.center(cell), nearest = nearestInHull(center, sites);
      EXPECT_LT((blended(blends[cell], sites) - nearest).norm(), 2e-7);
      const double distance = (center - nearest).norm();
      if (std::abs(distance - 1.0 / grid.size()) > 1e-9) { // not just at the limit
        EXPECT_EQ(blends[cell].isObserved, distance < 1.0 / grid.size());
      }
    }
  }
}

TEST(ViewBlend, PointsHaveTheBlendsOfCellsWithTheirCentresWhereverTheSearchBegins) {
  const ViewGrid grid(16);
  std::vector<DiscPoint> centers;
  for (size_t cell = 0; cell < grid.cells(); ++cell) centers.push_back(grid.center(cell));
  std::mt19937 random(3);
  for (const Sites& sites : siteSets()) {
    const SiteMesh mesh = siteMesh(sites);
    const std::vector<CellBlend> cells = cellBlends(mesh, sites, grid);
    std::vector<CellBlend> blends(grid.cells());
    std::vector<uint32_t> places(grid.cells());
    for (uint32_t& place : places) place = static_cast<uint32_t>(random() % 40);
    pointBlends(mesh, sites, centers, 1.0 / grid.size(), places, blends);
    for (size_t cell = 0; cell < grid.cells(); ++cell) {
      EXPECT_LT((blended(blends[cell], sites) - blended(cells[cell], sites)).norm(), 2e-7);
      EXPECT_EQ(blends[cell].isObserved, cells[cell].isObserved);
    }
  }
}

TEST(ViewBlend, CirclesOfTrianglesHoldNoOtherSite) {
  const Sites sites = randomSites(80, 3);
  const SiteMesh mesh = siteMesh(sites);
  EXPECT_EQ(mesh.triangles.size(), 2 * sites.size() - 2 - mesh.borders.size()); // Euler's formula
  for (const auto& [a, b, c] : mesh.triangles)
    for (const DiscPoint& p : sites) {
      Eigen::Matrix3d rows; // the in-circle determinant
      for (int k = 0; k < 3; ++k) {
        const DiscPoint d = sites[k == 0 ? a : k == 1 ? b : c] - p;
        rows.row(k) << d[0], d[1], d.squaredNorm();
      }
      EXPECT_LE(rows.determinant(), 1e-15);
    }
}

TEST(ViewBlend, ManySitesOnTheRimKeepTheirNumberOfTriangles) {
  Sites sites = randomSites(20, 7);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> azimuth(0, 2 * std::numbers::pi);
  for (size_t i = 0; i < 60; ++i) {
    const double phi = azimuth(random);
    sites.emplace_back(0.5 + 0.5 * std::cos(phi), 0.5 + 0.5 * std::sin(phi));
  }
  const SiteMesh mesh = siteMesh(sites);
  EXPECT_LE(mesh.triangles.size(), 2 * sites.size());
  double inTriangles = 0, inBorder = 0; // areas
  for (const auto& [a, b, c] : mesh.triangles) inTriangles += doubledArea(sites[a], sites[b], sites[c]);
  for (const auto& [a, b] : mesh.borders) inBorder += doubledArea(DiscPoint(0.5, 0.5), sites[a], sites[b]);
  EXPECT_NEAR(inTriangles, inBorder, 1e-12);
}

TEST(ViewBlend, ACellAtASiteShowsThatSiteAlone) {
  const ViewGrid grid(8);
  Sites sites = randomSites(20, 4);
  sites[7] = grid.center(27);
  const CellBlend blend = blendsOf(sites, grid)[27];
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(blend.weights[k], blend.sites[k] == 7 ? 1 : 0, 1e-7);
}

TEST(ViewBlend, NearlyEqualSitesDoNotSpoilTheHull) {
  const ViewGrid grid(8);
  Sites sites = randomSites(30, 5);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> move(-1e-12, 1e-12);
  for (size_t i = 0; i < 30; ++i) sites.push_back(sites[i] + DiscPoint(move(random), move(random)));
  const std::vector<CellBlend> blends = blendsOf(sites, grid);
  const Sites distinct(sites.begin(), sites.begin() + 30);
  for (size_t cell = 0; cell < grid.cells(); ++cell)
    EXPECT_LT((blended(blends[cell], sites) - nearestInHull(grid.center(cell), distinct)).norm(), 2e-7);
}

TEST(ViewBlend, ATriangulationHoldsUntilATriangleTurnsOver) {
  Sites sites{{0.1, 0.1}, {0.9, 0.1}, {0.9, 0.9}, {0.1, 0.9}, {0.5, 0.5}};
  const SiteMesh mesh = siteMesh(sites);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  sites[4] = {0.5, 0.12};
  EXPECT_TRUE(mesh.holdsFor(sites));
  const ViewGrid grid(8);
  const std::vector<CellBlend> blends = cellBlends(mesh, sites, grid);
  for (size_t cell = 0; cell < grid.cells(); ++cell)
    EXPECT_LT((blended(blends[cell], sites) - nearestInHull(grid.center(cell), sites)).norm(), 2e-7);
  sites[4] = {0.5, 0.08};
  EXPECT_FALSE(mesh.holdsFor(sites));
}

TEST(ViewBlend, WithoutSitesThereIsNoBlend) { EXPECT_TRUE(blendsOf({}, ViewGrid(4)).empty()); }

TEST(ViewGrid, CellsAreTexelsOfTheSquareAroundTheDisc) {
  const ViewGrid grid(32);
  EXPECT_EQ(grid.center(0), DiscPoint(0.5 / 32, 0.5 / 32));
  EXPECT_EQ(grid.center(33), DiscPoint(1.5 / 32, 1.5 / 32));
  size_t inDisc = 0;
  for (size_t cell = 0; cell < grid.cells(); ++cell) inDisc += grid.isInDisc(cell);
  EXPECT_NEAR(static_cast<double>(inDisc), 1024 * std::numbers::pi / 4, 8);
  EXPECT_FALSE(grid.isInDisc(0));
  EXPECT_THROW(ViewGrid(1), Error);
}

} // namespace
} // namespace surflect::lfm
