#include "render/lightfield/lfm/rings.h"

#include "render/lightfield/lfm/direction_disc.h"
#include "surfel/base/error.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace surflect::lfm {
namespace {

using slf::testing::meshOf;

// Place of a sample in multiples of edges, exact for corners on whole numbers.
std::array<double, 3> placeOf(const TriangleMesh& mesh, const Rings& rings, const PatchGrid& grid,
                              uint32_t triangle, size_t sample) {
  const std::array<int, 3> steps = grid.steps(sample);
  Vec3<double> place = Vec3<double>::Zero();
  for (size_t k = 0; k < 3; ++k)
    place += steps[k] * mesh.positions[rings.corners()[triangle][k]].raw().cast<double>();
  return {place[0], place[1], place[2]};
}

// Whole-numbered positions, so that samples on shared edges have equal places in floating point.
TriangleMesh rounded(TriangleMesh mesh) {
  for (auto& p : mesh.positions)
    p = {std::round(1000 * p.x()), std::round(1000 * p.y()), std::round(1000 * p.z())};
  return mesh;
}

// Three triangles at one edge, a bow tie of two at one vertex, and a vertex without triangles.
TriangleMesh awkwardMesh() {
  return meshOf({{0, 0, 0}, {4, 0, 0}, {1, 5, 0}, {1, -5, 0}, {1, 0, 5}, {7, 2, 0}, {7, -2, 1}, {9, 9, 9}},
                {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {1, 5, 6}});
}

std::vector<TriangleMesh> meshes() {
  return {rounded(slf::testing::bumpySphere(5, 7, 0.1)), rounded(slf::testing::squarePatch(3)),
          awkwardMesh()};
}

TEST(PatchGrid, EachSampleHasAPlaceOfItsOwn) {
  for (const int n : {2, 3, 8, 24}) {
    const PatchGrid grid(n);
    std::set<std::pair<int, int>> places;
    for (size_t sample = 0; sample < grid.samples(); ++sample) {
      const PatchPlace place = grid.place(sample);
      EXPECT_EQ(grid.index(place), sample);
      EXPECT_TRUE(place.i >= 0 && place.j >= 0 && place.i + place.j < n);
      places.insert({place.i, place.j});
    }
    EXPECT_EQ(places.size(), static_cast<size_t>(n * (n + 1) / 2));
  }
}

TEST(PatchGrid, CornersAreTheFirstTheEndOfTheFirstRowAndTheLastSample) {
  const PatchGrid grid(6);
  EXPECT_EQ(grid.barycentrics(0), Vec3<double>(1, 0, 0));
  EXPECT_EQ(grid.barycentrics(5), Vec3<double>(0, 1, 0));
  EXPECT_EQ(grid.barycentrics(20), Vec3<double>(0, 0, 1));
}

TEST(PatchGrid, ThePredefinedSizeHasASampleForEachPixel) {
  EXPECT_EQ(samplesPerEdgeFor(0), 4);
  EXPECT_EQ(samplesPerEdgeFor(10), 4);
  EXPECT_EQ(samplesPerEdgeFor(10.5), 6);
  EXPECT_EQ(samplesPerEdgeFor(300), 24);
  EXPECT_EQ(samplesPerEdgeFor(1e9), 32);
}

TEST(PatchGrid, SizesOutOfRangeAreRefused) {
  EXPECT_THROW(PatchGrid(1), Error);
  EXPECT_THROW(PatchGrid(257), Error);
}

TEST(VertexFrame, IsOrthonormalAndRightHandedAlongTheNormal) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Vec3<double> normal = randomUnit(random);
    const VertexFrame frame = frameAlong(1e-150 * normal);
    Mat3<double> axes;
    axes << frame.x, frame.y, frame.z;
    EXPECT_LT((axes.transpose() * axes - Mat3<double>::Identity()).norm(), 1e-14);
    EXPECT_GT(axes.determinant(), 0);
    EXPECT_LT((frame.z - normal).norm(), 1e-14);
  }
}

TEST(VertexFrame, PointsOfTheDiscGiveBackDirectionsOfTheUpperHemisphere) {
  std::mt19937 random(2);
  for (int i = 0; i < 1000; ++i) {
    const VertexFrame frame = frameAlong(randomUnit(random));
    Vec3<double> d = randomUnit(random);
    if (d.dot(frame.z) < 0) d = -d;
    const DiscPoint point = discPoint(frame, assume<Direction>(d));
    EXPECT_LE((2 * point - DiscPoint(1, 1)).norm(), 1 + 1e-15);
    // The square root loses half of the digits at the horizon.
    EXPECT_LT((directionAt(frame, point).raw() - d).norm(), 1e-15 / std::max(1e-8, d.dot(frame.z)));
  }
}

TEST(VertexFrame, DirectionsBelowTheHorizonHaveTheRimAtTheirAzimuth) {
  const VertexFrame frame;
  const DiscPoint point = discPoint(frame, assume<Direction>(Vec3<double>(0.3, -0.4, -std::sqrt(0.75))));
  EXPECT_LT((point - DiscPoint(0.8, 0.1)).norm(), 1e-15);
  EXPECT_LT((directionAt(frame, DiscPoint(1.4, -0.7)).raw() - Vec3<double>(0.6, -0.8, 0)).norm(), 1e-15);
}

TEST(Rings, EachTriangleIsAroundItsThreeVertices) {
  for (const TriangleMesh& mesh : meshes()) {
    const Rings rings(mesh);
    std::set<std::pair<uint32_t, int>> corners;
    for (const uint32_t v : rings.vertices())
      for (const auto& [triangle, corner] : rings.around(v)) {
        EXPECT_EQ(rings.corners()[triangle][corner], v);
        corners.insert({triangle, corner});
      }
    EXPECT_EQ(corners.size(), 3 * mesh.triangles.size());
  }
}

TEST(Rings, HatFunctionsOfATrianglesVerticesSumToOneAtEachSample) {
  const PatchGrid grid(7);
  for (const TriangleMesh& mesh : meshes()) {
    const Rings rings(mesh);
    std::vector<double> sums(mesh.triangles.size() * grid.samples(), 0);
    for (const uint32_t v : rings.vertices()) {
      const RingRows rows = ringRows(rings, v, grid);
      for (size_t r = 0; r < rings.around(v).size(); ++r)
        for (size_t s = 0; s < grid.samples(); ++s)
          if (const uint32_t row = rows.rowOf[r * grid.samples() + s]; row != RingRows::kNone)
            sums[rings.around(v)[r].triangle * grid.samples() + s] += static_cast<double>(rows.hats[row]);
    }
    for (const double sum : sums) EXPECT_NEAR(sum, 1, 1e-7);
  }
}

TEST(Rings, SamplesAreOneRowExactlyIfTheyAreOnePoint) {
  const PatchGrid grid(6);
  for (const TriangleMesh& mesh : meshes()) {
    const Rings rings(mesh);
    for (const uint32_t v : rings.vertices()) {
      const RingRows rows = ringRows(rings, v, grid);
      std::map<std::array<double, 3>, uint32_t> rowAt;
      for (uint32_t row = 0; row < rows.rows(); ++row) {
        EXPECT_GT(rows.hats[row], 0);
        for (const auto& [r, s] : rows.of(row)) {
          EXPECT_EQ(rows.rowOf[r * grid.samples() + s], row);
          const auto place = placeOf(mesh, rings, grid, rings.around(v)[r].triangle, s);
          EXPECT_EQ(rowAt.try_emplace(place, row).first->second, row);
        }
      }
      EXPECT_EQ(rowAt.size(), rows.rows());
    }
  }
}

TEST(Rings, SplitVerticesAreOneVertex) {
  const TriangleMesh whole = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {2, 1, 3}});
  const TriangleMesh split =
      meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}}, {{0, 1, 2}, {3, 4, 5}});
  const Rings a(whole), b(split);
  EXPECT_EQ(a.vertices().size(), b.vertices().size());
  EXPECT_EQ(b.around(2).size(), 2u);
  EXPECT_TRUE(b.around(3).empty());
  EXPECT_EQ(ringRows(a, 2, PatchGrid(5)).rows(), ringRows(b, 2, PatchGrid(5)).rows());
}

TEST(Rings, FramesAreAlongTheAreaWeightedNormal) {
  const TriangleMesh mesh = awkwardMesh();
  const Rings rings(mesh);
  const Vec3<double> sum = areaVector(mesh, 0) + areaVector(mesh, 1) + areaVector(mesh, 2);
  EXPECT_LT((rings.frame(0).z - sum.normalized()).norm(), 1e-15);
}

TEST(Rings, AVertexBetweenTwoOppositeSheetsHasTheFirstNormal) {
  const Rings rings(meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 2, 1}, {0, 1, 2}}));
  for (const uint32_t v : {0u, 1u, 2u}) EXPECT_EQ(rings.frame(v).z, Vec3<double>(0, 0, -1));
}

TEST(Rings, UnsoundMeshesAreRefused) {
  const std::vector<Vec3<double>> square{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}};
  EXPECT_THROW(Rings(meshOf(square, {{0, 1, 4}})), Error);
  EXPECT_THROW(Rings(meshOf(square, {{0, 1, 3}})), Error);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Rings(meshOf({{0, 0, 0}, {1, 0, 0}, {0, nan, 0}}, {{0, 1, 2}})), Error);
}

} // namespace
} // namespace surflect::lfm
