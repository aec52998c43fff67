#include "render/lightfield/slf/parametrization.h"

#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/plane_border.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/base/error.h"
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

double leastStretchOf(const Parametrization& map) { // 1 without stretch
  return map.stretch.leastStretch() / (2 * map.stretch.area * map.stretch.area);
}

// Flat square of 16 x 16 cells, cut along the middle column from the top to row 6; the cut gapes by 0.004.
TriangleMesh cutSquare() {
  TriangleMesh mesh = squarePatch(16);
  for (uint32_t row = 7; row <= 16; ++row) {
    const uint32_t left = row * 17 + 8;
    const auto& p = mesh.positions[left];
    for (auto& triangle : mesh.triangles)
      if (std::ranges::any_of(triangle, [&](uint32_t v) { return mesh.positions[v].x() > 0.51f; }))
        std::ranges::replace(triangle, left, static_cast<uint32_t>(mesh.positions.size()));
    mesh.positions.push_back({p.x() + 0.004f, p.y(), 0});
  }
  return mesh;
}

// Least distance in texels between points of the border that are far apart along it.
double narrowestGap(const Disc& disc, const Parametrization& map, double texels) {
  const double side = std::sqrt(texels / map.stretch.planeArea), aspect = std::sqrt(map.stretch.bestAspect());
  std::vector<Vec2<double>> border;
  for (const uint32_t v : disc.border)
    border.push_back(map.coordinates[v].cwiseProduct(Vec2<double>(side * aspect, side / aspect)));
  const size_t n = border.size();
  std::vector<double> reached(n + 1, 0);
  for (size_t i = 0; i < n; ++i) reached[i + 1] = reached[i] + (border[(i + 1) % n] - border[i]).norm();
  double least = reached[n];
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < i; ++j) {
      const double along = reached[i] - reached[j];
      if (std::min(along, reached[n] - along) > 10) least = std::min(least, (border[i] - border[j]).norm());
    }
  return least;
}

TEST(Parametrization, IsOneToOneWithinTheSquareForEveryRoughness) {
  for (const TriangleMesh& mesh : {shaken(squarePatch(9), 0.02f, 1), squarePatch(1), cutSquare()}) {
    const Disc disc = wholeOf(mesh);
    for (int roughness = 0; roughness <= kRoughest; ++roughness) {
      const Parametrization map = parametrizationOf(disc, 400, roughness);
      EXPECT_TRUE(std::isfinite(leastStretchOf(map))) << roughness;
      std::vector<Vec2<double>> border;
      for (const uint32_t v : disc.border) border.push_back(map.coordinates[v]);
      EXPECT_FALSE(crossesItself(border));
      for (const Vec2<double>& p : map.coordinates)
        EXPECT_TRUE((p.array() > -1e-12).all() && (p.array() < 1 + 1e-12).all());
    }
  }
}

TEST(Parametrization, RougherMapsHaveMoreStretch) {
  const Disc disc = wholeOf(shaken(squarePatch(9), 0.02f, 1));
  double before = 1;
  for (int roughness = 0; roughness <= kRoughest; ++roughness) {
    const double now = leastStretchOf(parametrizationOf(disc, 400, roughness));
    EXPECT_GT(now, before) << roughness;
    before = now;
  }
}

TEST(Parametrization, ATriangleKeepsItsShape) {
  // Longest edge 5, height 2.4, foot of the height 1.8 from the corner (0, 3).
  const Disc disc = wholeOf(meshOf({{0, 0, 0}, {4, 0, 0}, {0, 3, 0}}, {{0, 1, 2}}));
  const Parametrization map = parametrizationOf(disc, 100);
  EXPECT_NEAR(leastStretchOf(map), 2, 1e-9); // of half of its rectangle
  EXPECT_NEAR(map.stretch.bestAspect(), 5 / 2.4, 1e-6);
}

TEST(Parametrization, GapsInTheBorderAreTwoTexelsWide) {
  const Disc disc = wholeOf(cutSquare());
  const Parametrization coarse = parametrizationOf(disc, 900), fine = parametrizationOf(disc, 1e8);
  EXPECT_LT(narrowestGap(disc, fine, 900), 0.5); // flat as it is
  EXPECT_GT(narrowestGap(disc, coarse, 900), 1.9);
  EXPECT_LT(leastStretchOf(coarse), 1.15 * leastStretchOf(fine));
}

TEST(Parametrization, CanBeCancelledWhileStretchFalls) {
  const Disc disc = wholeOf(shaken(squarePatch(9), 0.02f, 1));
  int asked = 0;
  Progress progress;
  progress.cancelled = [&] { return ++asked > 3; };
  EXPECT_THROW(parametrizationOf(disc, 400, 0, progress), Cancelled);
  EXPECT_EQ(asked, 4);
}

} // namespace
} // namespace surflect::slf
