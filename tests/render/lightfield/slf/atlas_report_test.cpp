#include "render/lightfield/slf/atlas_report.h"

#include "render/lightfield/slf/chart.h"
#include "tests/render/lightfield/slf/meshes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

using namespace testing;

// Chart of a mesh of one region: (x, y) in texels is the coordinate, texel centres being whole.
Chart chartAt(const TriangleMesh& mesh, const std::vector<Vec2<double>>& texels, int width, int height) {
  Chart chart;
  chart.width = width, chart.height = height;
  for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
    chart.vertices.push_back(v);
    chart.coordinates.emplace_back(static_cast<float>((texels[v].x() + 0.5) / width),
                                   static_cast<float>((texels[v].y() + 0.5) / height));
  }
  chart.triangles = mesh.triangles;
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) chart.meshTriangles.push_back(t);
  return chart;
}

TEST(AtlasReport, OfARectangleMappedExactly) {
  // 6 x 3 on the surface over 12 x 6 texels between the middles of the outermost ones.
  const TriangleMesh mesh = meshOf({{0, 0, 0}, {6, 0, 0}, {6, 3, 0}, {0, 3, 0}}, {{0, 1, 2}, {0, 2, 3}});
  const Chart chart = chartAt(mesh, {{0, 0}, {12, 0}, {12, 6}, {0, 6}}, 13, 7);
  const AtlasReport report = atlasReport(mesh, std::array{chart}, 0.5);
  EXPECT_EQ(report.regions, 1u);
  EXPECT_NEAR(report.meanStretch, 1, 1e-6);
  EXPECT_NEAR(report.highStretch, 1, 1e-6);
  EXPECT_EQ(report.texels, 91u);
  EXPECT_EQ(report.texelsNeeded, 91u);
  EXPECT_EQ(report.redundancy, 1);
  EXPECT_NEAR(report.cost, 91 * 0.25 / 18, 1e-12);
  EXPECT_EQ(report.worstCone, 0);
  EXPECT_EQ(report.smallestShare, 1);
}

TEST(AtlasReport, StretchOfASquashedRectangle) {
  // Twice too dense along one axis: singular values 1 and 2, over a map of the same area sqrt(2).
  const TriangleMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}});
  const Chart chart = chartAt(mesh, {{0, 0}, {8, 0}, {8, 4}, {0, 4}}, 9, 5);
  const AtlasReport report = atlasReport(mesh, std::array{chart}, 0.1);
  EXPECT_NEAR(report.meanStretch, std::sqrt(5.0 / 4), 1e-6);
  EXPECT_NEAR(report.highStretch, std::sqrt(2.0), 1e-6);
}

TEST(AtlasReport, HighStretchIgnoresOneHundredthOfTheSurface) {
  // A square, and a strip of the given width that has a thousandth of a texel.
  const auto highStretch = [](double width) {
    const auto s = static_cast<float>(width);
    const TriangleMesh mesh = meshOf(
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2 + s, 0, 0}, {2 + s, 1, 0}, {2, 1, 0}},
        {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}});
    const Chart chart =
        chartAt(mesh, {{0, 0}, {8, 0}, {8, 8}, {0, 8}, {9, 0}, {9.001, 0}, {9.001, 8}, {9, 8}}, 11, 9);
    return atlasReport(mesh, std::array{chart}, 0.1).highStretch;
  };
  EXPECT_NEAR(highStretch(0.009), 1, 0.01);
  EXPECT_GT(highStretch(0.011), 50);
}

TEST(AtlasReport, ConesAndSharesAreThoseOfTheRegions) {
  // A roof of two halves, one region, and a flat triangle, another one.
  const TriangleMesh mesh = meshOf(
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 1}, {0, 1, 1}, {1, 2, 0}, {0, 2, 0}, {5, 0, 0}, {7, 0, 0}, {5, 1, 0}},
      {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}, {3, 4, 5}, {6, 7, 8}});
  std::vector<Vec2<double>> texels = {{0, 0},  {9, 0}, {9, 9}, {0, 9}, {9, 18},
                                      {0, 18}, {0, 0}, {9, 0}, {0, 9}};
  Chart roof = chartAt(mesh, texels, 10, 19), flat = roof;
  roof.triangles.pop_back(), roof.meshTriangles.pop_back();
  flat.triangles = {mesh.triangles[4]}, flat.meshTriangles = {4};
  const AtlasReport report = atlasReport(mesh, std::array{roof, flat}, 0.1);
  EXPECT_NEAR(report.worstCone, 45, 0.4);
  const double areaOfRoof = 2 * std::sqrt(2.0);
  EXPECT_NEAR(report.meanCone, report.worstCone * areaOfRoof / (areaOfRoof + 1), 1e-9);
  EXPECT_NEAR(report.smallestShare, 2 / (areaOfRoof + 1), 1e-12);
  EXPECT_NEAR(report.largestShare, 2 * areaOfRoof / (areaOfRoof + 1), 1e-12);
}

TEST(AtlasReport, TexelsInReachAreThoseThatSamplesWeigh) {
  // Against many samples: all of their texels are in reach, and almost no others.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const TriangleMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
    std::vector<Vec2<double>> p;
    for (int k = 0; k < 3; ++k) p.emplace_back(9 * number(random), 9 * number(random));
    const Chart chart = chartAt(mesh, p, 10, 10);
    for (uint32_t k = 0; k < 3; ++k) p[k] = chart.coordinates[k].cast<double>() * 10 - Vec2<double>(0.5, 0.5);
    std::vector<uint8_t> isWeighed(100, 0);
    for (int sample = 0; sample < 20000; ++sample) {
      double b = number(random), c = number(random);
      if (b + c > 1) b = 1 - b, c = 1 - c;
      const Vec2<double> at = p[0] + b * (p[1] - p[0]) + c * (p[2] - p[0]);
      const auto x = static_cast<size_t>(at.x()), y = static_cast<size_t>(at.y());
      for (const size_t texel : {10 * y + x, 10 * y + x + 1, 10 * y + x + 10, 10 * y + x + 11})
        if (texel < 100) isWeighed[texel] = 1;
    }
    size_t weighed = 0;
    for (const uint8_t is : isWeighed) weighed += is;
    EXPECT_GE(texelsInReach(chart), weighed);
    EXPECT_LE(texelsInReach(chart), weighed + 2); // slivers of reach that no sample met
  }
}

TEST(AtlasReport, OfNoChartsIsEmpty) { EXPECT_EQ(atlasReport(squarePatch(1), {}, 1).texels, 0u); }

} // namespace
} // namespace surflect::slf
