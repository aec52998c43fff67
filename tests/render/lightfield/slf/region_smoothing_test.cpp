#include "render/lightfield/slf/region_smoothing.h"

#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/region_merging.h"
#include "tests/render/lightfield/slf/meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace surflect::slf {
namespace {

using namespace testing;

Vec3<double> middleOf(const TriangleMesh& mesh, size_t triangle) {
  Vec3<double> sum = Vec3<double>::Zero();
  for (const uint32_t v : mesh.triangles[triangle]) sum += mesh.positions[v].raw().cast<double>();
  return sum / 3;
}

// Two regions; the second has the triangles whose middles are in a set.
Regions cut(const TriangleMesh& mesh, const std::function<bool(const Vec3<double>&)>& isInSecond) {
  Regions regions{{}, 2};
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    regions.ofTriangle.push_back(isInSecond(middleOf(mesh, t)));
  return regions;
}

Regions smoothed(const TriangleMesh& mesh, Regions regions, const RegionOptions& options = {}) {
  smoothRegions(mesh, triangleGraph(mesh), triangleMoments(mesh), options, regions);
  return regions;
}

double borderLength(const TriangleMesh& mesh, const Regions& regions) {
  const TriangleGraph graph = triangleGraph(mesh);
  double length = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t neighbor = graph.neighbors[t][k];
      if (neighbor == kNoTriangle || regions.ofTriangle[neighbor] == regions.ofTriangle[t]) continue;
      const auto& corners = mesh.triangles[t];
      length += (mesh.positions[corners[k]].raw() - mesh.positions[corners[(k + 1) % 3]].raw()).norm() / 2;
    }
  return length;
}

// Sum over regions of E(R) + w l border / 2 (region_moments.h), up to a constant: the integral of |x - mean
// x|^2 over a region is that of |x|^2 less |integral of x|^2 / area, and likewise for normals.
double energyOf(const TriangleMesh& mesh, const Regions& regions) {
  const std::vector<RegionMoments> moments = triangleMoments(mesh);
  std::vector<RegionMoments> sums(regions.count);
  double area = 0;
  for (size_t t = 0; t < moments.size(); ++t) {
    sums[regions.ofTriangle[t]] = sums[regions.ofTriangle[t]] + moments[t];
    area += moments[t].area;
  }
  const double squaredLength = area / static_cast<double>(regions.count);
  double energy = 0.15 * std::sqrt(squaredLength) * borderLength(mesh, regions);
  for (const RegionMoments& sum : sums)
    energy -= (sum.point.squaredNorm() / squaredLength + sum.normal.squaredNorm()) / sum.area;
  return energy;
}

TEST(RegionSmoothing, LowersTheEnergyAndKeepsDiscs) {
  for (const TriangleMesh& mesh : {shaken(bumpySphere(40, 41, 0.2), 0.01f, 1), torus(60, 30)}) {
    const TriangleGraph graph = triangleGraph(mesh);
    Regions merged{mergedRegions(mesh, graph, triangleMoments(mesh), {.regions = 30}), 0};
    std::vector<uint32_t> numbers(mesh.triangles.size(), kNoTriangle);
    for (uint32_t& region : merged.ofTriangle) {
      uint32_t& number = numbers[region];
      if (number == kNoTriangle) number = static_cast<uint32_t>(merged.count++);
      region = number;
    }
    const Regions after = smoothed(mesh, merged);
    EXPECT_LT(energyOf(mesh, after), energyOf(mesh, merged));
    EXPECT_LT(borderLength(mesh, after), borderLength(mesh, merged));
    for (const std::vector<uint32_t>& triangles : after.triangles()) {
      ASSERT_FALSE(triangles.empty());
      EXPECT_TRUE(discOf(mesh, graph, triangles));
    }
    // There is nothing left to move.
    EXPECT_EQ(smoothed(mesh, after).ofTriangle, after.ofTriangle);
  }
}

// Square of 16 x 16 cells, cut at half its height. Four triangles of the lower region stick out.
Regions toothed(const TriangleMesh& flat) {
  return cut(flat, [](const Vec3<double>& p) {
    const bool isTooth = static_cast<int>(16 * p.x()) % 4 == 1 && p.y() < 0.53;
    return p.y() > 0.5 && !isTooth;
  });
}

TEST(RegionSmoothing, StraightensAJaggedBorder) {
  const TriangleMesh mesh = squarePatch(16);
  EXPECT_NEAR(borderLength(mesh, toothed(mesh)), 1 + 4 * std::sqrt(2) / 16, 1e-6);
  EXPECT_EQ(smoothed(mesh, toothed(mesh)).ofTriangle,
            cut(mesh, [](const Vec3<double>& p) { return p.y() > 0.5; }).ofTriangle);
}

TEST(RegionSmoothing, NormalsStayWithinTheConeAboutTheAxisThatARegionHad) {
  // The last quarter is folded by 60 degrees, so that the upper region's axis is 30 degrees from the teeth.
  const TriangleMesh flat = squarePatch(16);
  TriangleMesh folded = flat;
  for (auto& p : folded.positions)
    if (p.y() > 0.75f) p = {p.x(), 0.75f + 0.5f * (p.y() - 0.75f), 0.8660254f * (p.y() - 0.75f)};
  const Regions before = toothed(flat);
  const auto after = [&](double degrees) {
    return smoothed(folded, before, {.widestCone = Angle::fromDegrees(degrees)});
  };
  EXPECT_EQ(after(29).ofTriangle, before.ofTriangle);
  EXPECT_NEAR(borderLength(folded, after(31)), 1, 1e-6);
}

TEST(RegionSmoothing, CanBeCancelled) {
  const TriangleMesh mesh = squarePatch(16);
  Regions regions = toothed(mesh);
  const Progress stop{.report = {}, .cancelled = [] { return true; }};
  EXPECT_THROW(smoothRegions(mesh, triangleGraph(mesh), triangleMoments(mesh), {}, regions, stop), Cancelled);
}

} // namespace
} // namespace surflect::slf
