#include "render/lightfield/slf/texel_points.h"

#include "tests/support/box_capture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace surflect::slf {
namespace {

// A triangle in the plane z = 2 with corners (0, 0), (1, 0), (0, 1); its chart fills half of the texture.
struct Single {
  TriangleMesh mesh{{{0, 0, 2}, {1, 0, 2}, {0, 1, 2}}, {{0, 1, 2}}};
  Chart chart;

  explicit Single(int side) {
    const float low = 0.5f / static_cast<float>(side), high = 1 - low;
    chart = {{0, 1, 2}, {{low, low}, {high, low}, {low, high}}, {{0, 1, 2}}, {0}, side, side};
  }
};

TEST(TexelPoints, CornersOfAFaceAreTheOuterTexels) {
  const TriangleMesh cube = boxes::unitCube();
  constexpr int kSide = 5;
  for (const Chart& chart : boxes::faceCharts(cube, kSide)) {
    const std::vector<TexelPoint> points = texelPoints(cube, chart);
    ASSERT_EQ(points.size(), chart.texels());
    for (size_t v = 0; v < chart.vertices.size(); ++v) {
      const auto i = static_cast<size_t>(chart.coordinates[v][0] * kSide),
                 j = static_cast<size_t>(chart.coordinates[v][1] * kSide);
      const Vec3<double> corner = cube.positions[chart.vertices[v]].raw().cast<double>();
      EXPECT_NEAR((points[j * kSide + i].position.raw() - corner).norm(), 0, 1e-6);
    }
  }
}

TEST(TexelPoints, InsideTexelsLieOnTheirTriangleWhereTheChartSays) {
  constexpr int kSide = 9;
  const Single single(kSide);
  const std::vector<TexelPoint> points = texelPoints(single.mesh, single.chart);
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i + j < kSide; ++i) {
      const TexelPoint& point = points[static_cast<size_t>(j * kSide + i)];
      EXPECT_TRUE(point.isInside);
      EXPECT_EQ(point.meshTriangle, 0u);
      EXPECT_NEAR((point.position.raw() - Vec3<double>(i / 8.0, j / 8.0, 2)).norm(), 0, 1e-6);
    }
}

TEST(TexelPoints, OutsideTexelsTakeTheNearestPointOfTheChart) {
  constexpr int kSide = 9;
  const Single single(kSide);
  const std::vector<TexelPoint> points = texelPoints(single.mesh, single.chart);
  for (int j = 0; j < kSide; ++j)
    for (int i = kSide - j; i < kSide; ++i) { // beyond the hypotenuse
      const TexelPoint& point = points[static_cast<size_t>(j * kSide + i)];
      EXPECT_FALSE(point.isInside);
      const double along = (8 + i - j) / 16.0;
      EXPECT_NEAR((point.position.raw() - Vec3<double>(along, 1 - along, 2)).norm(), 0, 1e-6);
    }
}

TEST(TexelPoints, NoTexelFallsBetweenTwoTriangles) {
  const TriangleMesh cube = boxes::unitCube();
  for (const int side : {4, 7, 64})
    for (const Chart& chart : boxes::faceCharts(cube, side))
      EXPECT_TRUE(std::ranges::all_of(texelPoints(cube, chart), &TexelPoint::isInside)) << side;
}

TEST(TexelPoints, TrianglesWithoutAreaTakeNoTexel) {
  Single single(6);
  single.mesh.positions.push_back({0.5f, 0.5f, 2});
  single.mesh.triangles.push_back({1, 3, 2}); // flat on the surface, though not in the chart
  single.chart.vertices.push_back(3);
  single.chart.coordinates.emplace_back(0.9f, 0.9f);
  single.chart.triangles.push_back({1, 3, 2});
  single.chart.meshTriangles.push_back(1);
  for (const TexelPoint& point : texelPoints(single.mesh, single.chart)) {
    EXPECT_EQ(point.meshTriangle, 0u);
    EXPECT_TRUE(point.position.raw().allFinite());
  }
}

TEST(TexelPoints, AChartWithoutAreaHasNoPoints) {
  Single single(4);
  for (auto& coordinates : single.chart.coordinates) coordinates = {0.5f, 0.5f};
  for (const TexelPoint& point : texelPoints(single.mesh, single.chart))
    EXPECT_EQ(point.meshTriangle, TexelPoint::kNone);
}

} // namespace
} // namespace surflect::slf
