#include "render/lightfield/slf/charts.h"

#include "render/lightfield/slf/parametrization.h"
#include "render/lightfield/slf/regions.h"
#include "render/lightfield/slf/texel_radiance.h"
#include "surfel/base/error.h"
#include "tests/render/lightfield/slf/meshes.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace surflect::slf {
namespace {

using namespace testing;

std::vector<Chart> chartsFor(const TriangleMesh& mesh, size_t regions, double texelSize,
                             const Progress& progress = {}) {
  return chartsOf(mesh, regionsOf(mesh, {.regions = regions}), texelSize, progress);
}

Vec2<double> at(const Chart& chart, uint32_t vertex) { return chart.coordinates[vertex].cast<double>(); }

// Corners of the border in its order, found by edges that only one triangle has.
std::vector<uint32_t> borderOf(const Chart& chart) {
  std::map<std::pair<uint32_t, uint32_t>, int> edges;
  for (const auto& t : chart.triangles)
    for (size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  std::map<uint32_t, uint32_t> next;
  for (const auto& [edge, count] : edges)
    if (!edges.contains({edge.second, edge.first})) next[edge.first] = edge.second;
  std::vector<uint32_t> border;
  for (uint32_t v = next.begin()->first; border.size() < next.size(); v = next.at(v)) border.push_back(v);
  return border;
}

// Charts cover the mesh, and each is one to one: triangles are positive, and the border does not cross
// itself.
void expectOneToOne(const TriangleMesh& mesh, const std::vector<Chart>& charts) {
  std::vector<int> covered(mesh.triangles.size(), 0);
  for (const Chart& chart : charts) {
    ASSERT_EQ(chart.coordinates.size(), chart.vertices.size());
    ASSERT_EQ(chart.triangles.size(), chart.meshTriangles.size());
    ASSERT_GE(chart.width, 4);
    ASSERT_GE(chart.height, 4);
    std::vector<uint32_t> sorted = chart.vertices;
    std::ranges::sort(sorted);
    EXPECT_EQ(std::ranges::adjacent_find(sorted), sorted.end());
    const double gutterX = 0.5 / chart.width, gutterY = 0.5 / chart.height;
    for (uint32_t v = 0; v < chart.vertices.size(); ++v) {
      EXPECT_TRUE(at(chart, v).x() > gutterX - 1e-7 && at(chart, v).x() < 1 - gutterX + 1e-7);
      EXPECT_TRUE(at(chart, v).y() > gutterY - 1e-7 && at(chart, v).y() < 1 - gutterY + 1e-7);
    }
    double area = 0;
    for (size_t t = 0; t < chart.triangles.size(); ++t) {
      const auto& [i, j, k] = chart.triangles[t];
      const double own = planeArea(at(chart, i), at(chart, j), at(chart, k));
      EXPECT_GT(own, 0);
      area += own;
      ++covered[chart.meshTriangles[t]];
      for (size_t corner = 0; corner < 3; ++corner)
        EXPECT_EQ(mesh.positions[chart.vertices[chart.triangles[t][corner]]],
                  mesh.positions[mesh.triangles[chart.meshTriangles[t]][corner]]);
    }
    const std::vector<uint32_t> border = borderOf(chart);
    const size_t n = border.size();
    double enclosed = 0;
    for (size_t i = 0; i < n; ++i)
      enclosed += planeArea(at(chart, border[0]), at(chart, border[i]), at(chart, border[(i + 1) % n]));
    EXPECT_NEAR(area, enclosed, 1e-12);
    for (size_t i = 0; i < n; ++i)
      for (size_t j = i + 2; j < n && j + 1 < n + i; ++j) {
        const Vec2<double> a = at(chart, border[i]), b = at(chart, border[i + 1]);
        const Vec2<double> c = at(chart, border[j]), d = at(chart, border[(j + 1) % n]);
        const bool isCrossing =
            planeArea(a, b, c) * planeArea(a, b, d) < 0 && planeArea(c, d, a) * planeArea(c, d, b) < 0;
        EXPECT_FALSE(isCrossing) << i << ' ' << j;
      }
  }
  EXPECT_EQ(std::ranges::count(covered, 1), static_cast<ptrdiff_t>(covered.size()));
}

// Largest distance between the middle of a triangle and the surface points of the texels that a look-up there
// reads, by their weights; in texels.
double farthestLookUp(const TriangleMesh& mesh, const std::vector<Chart>& charts, double texelSize) {
  double farthest = 0;
  for (const Chart& chart : charts) {
    const std::vector<TexelPoint> points = texelPoints(mesh, chart);
    for (const auto& triangle : chart.triangles) {
      Vec2<double> place(0, 0);
      Vec3<double> middle(0, 0, 0);
      for (const uint32_t v : triangle) {
        place += at(chart, v).cwiseProduct(Vec2<double>(chart.width, chart.height)) / 3;
        middle += mesh.positions[chart.vertices[v]].cast<double>().raw() / 3;
      }
      const Vec2<double> between = place.array() - 0.5;
      double distance = 0;
      for (int y = std::max(0, static_cast<int>(between.y())); y < chart.height && y <= between.y() + 1; ++y)
        for (int x = std::max(0, static_cast<int>(between.x())); x < chart.width && x <= between.x() + 1; ++x)
          distance += (1 - std::abs(between.x() - x)) * (1 - std::abs(between.y() - y)) *
                      (points[static_cast<size_t>(y * chart.width + x)].position.raw() - middle).norm();
      farthest = std::max(farthest, distance / texelSize);
    }
  }
  return farthest;
}

// Distance on the surface for a unit length in texels, over that of a map that keeps all areas: its root mean
// square over the surface and all directions; 1 is best.
double meanStretch(const TriangleMesh& mesh, const std::vector<Chart>& charts) {
  double squares = 0, area = 0, planeArea = 0;
  for (const Chart& chart : charts) {
    std::vector<Vec3<double>> positions;
    std::vector<Vec2<double>> texels;
    for (uint32_t v = 0; v < chart.vertices.size(); ++v) {
      positions.push_back(mesh.positions[chart.vertices[v]].cast<double>().raw());
      texels.push_back(at(chart, v).cwiseProduct(Vec2<double>(chart.width, chart.height)));
    }
    const StretchSums sums = stretchSums(positions, chart.triangles, texels);
    squares += (sums.a + sums.c) / 2, area += sums.area, planeArea += sums.planeArea;
  }
  return std::sqrt(squares / area * planeArea / area);
}

// Texels of charts over those of a square grid on the surface.
double costOf(const TriangleMesh& mesh, const std::vector<Chart>& charts, double texelSize) {
  double texels = 0;
  for (const Chart& chart : charts) texels += static_cast<double>(chart.texels());
  return texels * texelSize * texelSize / surfaceArea(mesh);
}

TEST(Charts, AreOneToOneOnBumpyMeshes) {
  for (const TriangleMesh& mesh : {shaken(bumpySphere(40, 41, 0.2), 0.01f, 1), torus(40, 20)})
    expectOneToOne(mesh, chartsFor(mesh, 20, 0.02));
}

TEST(Charts, HaveFewTexelsAndLookUpsReadThoseNearBy) {
  // 20,000 triangles each: regular, and irregular.
  const double texelSize = 0.01;
  for (const TriangleMesh& mesh :
       {bumpySphere(101, 100, 0.1), shaken(bumpySphere(101, 100, 0.2), 0.003f, 1)}) {
    const std::vector<Chart> charts = chartsFor(mesh, 100, texelSize);
    EXPECT_EQ(charts.size(), 100u);
    EXPECT_LT(costOf(mesh, charts, texelSize), 1.15);
    EXPECT_LT(farthestLookUp(mesh, charts, texelSize), 13);
  }
}

TEST(Charts, AFlatSquareIsMappedWithoutStretch) {
  const TriangleMesh mesh = squarePatch(10);
  const std::vector<Chart> charts = chartsFor(mesh, 1, 0.01);
  ASSERT_EQ(charts.size(), 1u);
  expectOneToOne(mesh, charts);
  EXPECT_LT(meanStretch(mesh, charts), 1.1);
  EXPECT_NEAR(charts[0].width, 101, 1);
  EXPECT_NEAR(charts[0].height, 101, 1);
}

TEST(Charts, ALongRectangleGetsItsAspect) {
  TriangleMesh mesh = squarePatch(10);
  for (auto& p : mesh.positions) p = {p.x() * 4, p.y(), p.z()};
  const std::vector<Chart> charts = chartsFor(mesh, 1, 0.02);
  ASSERT_EQ(charts.size(), 1u);
  const auto [shorter, longer] = std::minmax(charts[0].width, charts[0].height);
  EXPECT_NEAR(longer, 201, 3);
  EXPECT_NEAR(shorter, 51, 2);
}

TEST(Charts, TexelsFollowTheirSize) {
  const TriangleMesh mesh = bumpySphere(30, 31, 0.1);
  double area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) area += areaVector(mesh, t).norm() / 2;
  for (const double texelSize : {0.02, 0.005}) {
    double texels = 0;
    for (const Chart& chart : chartsFor(mesh, 20, texelSize)) texels += static_cast<double>(chart.texels());
    const double side = std::sqrt(area / 20) / texelSize; // a region's, and one for the gutter
    EXPECT_NEAR(texels * texelSize * texelSize / area, (side + 1) * (side + 1) / (side * side), 0.04);
  }
}

TEST(Charts, LargeTexelsLeaveFourASide) {
  for (const Chart& chart : chartsFor(torus(20, 10), 10, 100)) EXPECT_EQ(chart.texels(), 16u);
}

TEST(Charts, FittedOnesHaveTheMostTexelsAndAreAsThoseOfTheirSize) {
  const TriangleMesh mesh = bumpySphere(30, 31, 0.1);
  const Regions regions = regionsOf(mesh, {.regions = 20});
  const auto texelsOf = [](const std::vector<Chart>& charts) {
    double texels = 0;
    for (const Chart& chart : charts) texels += static_cast<double>(chart.texels());
    return texels;
  };
  const FittedCharts fitted = fittedCharts(mesh, regions, 0.01, 20000);
  EXPECT_NEAR(texelsOf(fitted.charts) / 20000, 1, 0.05);
  expectOneToOne(mesh, fitted.charts);
  EXPECT_LT(costOf(mesh, fitted.charts, fitted.texelSize), 1.25);
  // Charts that need not change have the wanted size.
  const FittedCharts free = fittedCharts(mesh, regions, 0.02, 1'000'000);
  const std::vector<Chart> charts = chartsOf(mesh, regions, 0.02);
  EXPECT_EQ(free.texelSize, 0.02);
  ASSERT_EQ(free.charts.size(), charts.size());
  for (size_t i = 0; i < charts.size(); ++i) EXPECT_EQ(free.charts[i].coordinates, charts[i].coordinates);
  // 20 charts of the fewest texels.
  EXPECT_EQ(texelsOf(fittedCharts(mesh, regions, 0.01, 1).charts), 20 * 16);
}

TEST(Charts, NeighborsShareTheVerticesOfTheirBorder) {
  const TriangleMesh mesh = torus(30, 20);
  std::map<uint32_t, int> chartsOfVertex;
  size_t onBorders = 0;
  const std::vector<Chart> charts = chartsFor(mesh, 15, 0.05);
  for (const Chart& chart : charts) {
    for (const uint32_t v : chart.vertices) ++chartsOfVertex[v];
    onBorders += borderOf(chart).size();
  }
  size_t shared = 0;
  for (const auto& [vertex, count] : chartsOfVertex)
    if (count > 1) shared += static_cast<size_t>(count);
  EXPECT_EQ(shared, onBorders);
}

TEST(Charts, AreTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = shaken(bumpySphere(30, 31, 0.1), 0.01f, 1);
  const Regions regions = regionsOf(mesh, {.regions = 20});
  tbb::task_arena one(1);
  const std::vector<Chart> alone = one.execute([&] { return chartsOf(mesh, regions, 0.02); });
  const std::vector<Chart> all = chartsOf(mesh, regions, 0.02);
  ASSERT_EQ(alone.size(), all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(alone[i].coordinates, all[i].coordinates);
    EXPECT_EQ(alone[i].vertices, all[i].vertices);
    EXPECT_EQ(alone[i].width, all[i].width);
  }
}

TEST(Charts, OfASingleTriangleAndOfTwo) {
  const TriangleMesh one = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  const TriangleMesh two = squarePatch(1);
  const TriangleMesh star =
      meshOf({{0, 0, 0}, {2, 0, 0}, {1, 2, 0}, {1, 1, 0.1}}, {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
  for (const TriangleMesh& mesh : {one, two, star}) {
    const std::vector<Chart> charts = chartsFor(mesh, 1, 0.05);
    EXPECT_EQ(charts.size(), 1u);
    expectOneToOne(mesh, charts);
  }
}

TEST(Charts, SliversAreOneToOneToo) {
  // Cells a thousand times as long as wide, and triangles without any area.
  TriangleMesh mesh = squarePatch(20);
  std::mt19937 random(1);
  for (size_t v = 0; v < mesh.positions.size(); ++v) {
    const auto& p = mesh.positions[v];
    const auto row = std::lround(p.y() * 20);
    const auto height = static_cast<float>(row / 2) * 0.1f + (row % 2 ? 1e-4f : 0);
    mesh.positions[v] = {p.x() + (random() % 4 ? 0.f : 0.025f), height, 0};
  }
  for (size_t v = 0; v + 1 < mesh.positions.size(); v += 7)
    if (v % 21 < 20) mesh.positions[v] = {mesh.positions[v].x(), mesh.positions[v + 1].y(), 0};
  expectOneToOne(mesh, chartsFor(mesh, 10, 0.01));
}

TEST(Charts, AMeshWithoutAreaHasCharts) {
  TriangleMesh mesh = squarePatch(6);
  for (auto& p : mesh.positions) p = {p.x() + 8 * p.y(), 0, 0}; // on a line
  const std::vector<Chart> charts = chartsFor(mesh, 5, 0.01);
  expectOneToOne(mesh, charts);
}

TEST(Charts, ALongTubeIsCutWhereOneChartCannotHoldIt) {
  // A tube closed at one end and 200 rings long, as one region: rounding would flatten its end.
  TriangleMesh mesh = bumpySphere(200, 4);
  for (auto& p : mesh.positions) {
    const float along = std::acos(std::clamp(p.z() / 1.f, -1.f, 1.f));
    p = {p.x() * 0.01f, p.y() * 0.01f, along};
  }
  mesh.triangles.resize(mesh.triangles.size() - 1);
  const Regions whole{std::vector<uint32_t>(mesh.triangles.size(), 0), 1};
  const std::vector<Chart> charts = chartsOf(mesh, whole, 0.01);
  EXPECT_GT(charts.size(), 1u);
  expectOneToOne(mesh, charts);
}

TEST(Charts, UnusableTexelSizesAreRefused) {
  const TriangleMesh mesh = squarePatch(2);
  const auto problem = [&](double size) -> std::string {
    try {
      chartsFor(mesh, 1, size);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(problem(0), "texel size: found 0, expected a positive number");
  EXPECT_EQ(problem(-1), "texel size: found -1, expected a positive number");
  EXPECT_NE(problem(std::numeric_limits<double>::quiet_NaN()), "");
  EXPECT_NE(problem(std::numeric_limits<double>::infinity()), "");
  EXPECT_NE(problem(1e-6).find("expected textures of at most 16384 texels a side"), std::string::npos);
}

TEST(Charts, CanBeCancelled) {
  Progress progress;
  const TriangleMesh mesh = squarePatch(10);
  const Regions regions = regionsOf(mesh, {.regions = 4});
  progress.cancelled = [] { return true; };
  EXPECT_THROW(chartsOf(mesh, regions, 0.1, progress), Cancelled);
}

} // namespace
} // namespace surflect::slf
