#include "render/lightfield/slf/regions.h"

#include "render/lightfield/slf/blackout_cone.h"
#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/base/error.h"
#include "tests/render/lightfield/slf/meshes.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <random>
#include <set>
#include <vector>

namespace surflect::slf {

namespace {

using namespace testing;

// Areas of regions over their mean, in rising order.
std::vector<double> sharesOf(const TriangleMesh& mesh, const Regions& regions) {
  std::vector<double> shares(regions.count, 0);
  double sum = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double area = areaVector(mesh, t).norm();
    shares[regions.ofTriangle[t]] += area, sum += area;
  }
  for (double& share : shares) share *= static_cast<double>(regions.count) / sum;
  std::ranges::sort(shares);
  return shares;
}

// Every triangle is in one region, and every region is a disc.
void expectDiscs(const TriangleMesh& mesh, const Regions& regions) {
  const TriangleGraph graph = triangleGraph(mesh);
  ASSERT_EQ(regions.ofTriangle.size(), mesh.triangles.size());
  size_t covered = 0;
  for (const std::vector<uint32_t>& triangles : regions.triangles()) {
    covered += triangles.size();
    EXPECT_TRUE(discOf(mesh, graph, triangles)) << triangles.size() << " triangles from " << triangles.at(0);
  }
  EXPECT_EQ(covered, mesh.triangles.size());
}

TEST(Regions, AreDiscsAndAsManyAsWanted) {
  for (const size_t wanted : {size_t{20}, size_t{40}, size_t{200}})
    for (const TriangleMesh& mesh : {bumpySphere(40, 41, 0.1), torus(60, 30), squarePatch(40)}) {
      const Regions regions = regionsOf(mesh, {.regions = wanted});
      EXPECT_EQ(regions.count, wanted);
      expectDiscs(mesh, regions);
    }
}

TEST(Regions, AreNumberedByTheirFirstTriangles) {
  const Regions regions = regionsOf(torus(30, 20), {.regions = 20});
  uint32_t next = 0;
  for (const uint32_t region : regions.ofTriangle) {
    EXPECT_LE(region, next);
    next = std::max(next, region + 1);
  }
  EXPECT_EQ(next, regions.count);
}

TEST(Regions, AreEvenInSize) {
  const std::vector<double> shares = sharesOf(squarePatch(80), regionsOf(squarePatch(80), {.regions = 100}));
  EXPECT_GT(shares.front(), 0.4);
  EXPECT_LT(shares.back(), 1.8);
}

TEST(Regions, NormalsStayWithinTheCone) {
  const TriangleMesh mesh = torus(60, 30);
  for (const double widest : {20.0, 40.0, 80.0}) {
    const Regions regions = regionsOf(mesh, {.regions = 4, .widestCone = Angle::fromDegrees(widest)});
    expectDiscs(mesh, regions);
    double reached = 0;
    for (const std::vector<uint32_t>& triangles : regions.triangles())
      reached = std::max(reached, normalCone(mesh, triangles).halfAngle.degrees());
    EXPECT_LE(reached, widest * 1.01);
    EXPECT_GT(reached, widest / 2); // it is the cone that ended the merging
  }
}

TEST(Regions, FollowEdgesOfACube) {
  // Six faces, each flat: six regions are the faces.
  TriangleMesh mesh;
  for (int face = 0; face < 6; ++face) {
    TriangleMesh side = squarePatch(8);
    for (auto& p : side.positions) {
      Vec3<float> q(p.x() - 0.5f, p.y() - 0.5f, 0.5f);
      for (int turn = 0; turn < face % 4; ++turn) q = Vec3<float>(q.z(), q.y(), -q.x());
      if (face >= 4) {
        q = Vec3<float>(p.x() - 0.5f, p.y() - 0.5f, 0.5f);
        q = face == 4 ? Vec3<float>(q.x(), q.z(), -q.y()) : Vec3<float>(q.x(), -q.z(), q.y());
      }
      p = {q.x(), q.y(), q.z()};
    }
    mesh = together(std::move(mesh), side);
  }
  const Regions regions = regionsOf(mesh, {.regions = 6});
  expectDiscs(mesh, regions);
  ASSERT_EQ(regions.count, 6u);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) EXPECT_EQ(regions.ofTriangle[t], t / 128);
}

TEST(Regions, AreTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = shaken(bumpySphere(40, 41, 0.1), 0.01f, 1);
  tbb::task_arena one(1);
  const Regions alone = one.execute([&] { return regionsOf(mesh, {.regions = 50}); });
  EXPECT_EQ(alone.ofTriangle, regionsOf(mesh, {.regions = 50}).ofTriangle);
}

TEST(Regions, DoNotDependOnPlaceAndHardlyOnScale) {
  // By a power of 2, so that rounding is the same.
  TriangleMesh mesh = shaken(torus(30, 20), 0.01f, 1);
  const Regions before = regionsOf(mesh, {.regions = 30});
  for (auto& p : mesh.positions) p = {p.x() * 1024, p.y() * 1024, p.z() * 1024};
  EXPECT_EQ(regionsOf(mesh, {.regions = 30}).ofTriangle, before.ofTriangle);
}

TEST(Regions, AClosedPartHasAtLeastTwo) {
  for (const TriangleMesh& mesh : {bumpySphere(8, 8), torus(8, 8)}) {
    const Regions regions = regionsOf(mesh, {.regions = 1, .widestCone = Angle::fromDegrees(180)});
    EXPECT_GE(regions.count, 2u);
    EXPECT_LE(regions.count, 6u);
    expectDiscs(mesh, regions);
  }
}

TEST(Regions, PartsOfTheMeshStayApart) {
  const TriangleMesh mesh = together(squarePatch(4), bumpySphere(8, 8));
  const Regions regions = regionsOf(mesh, {.regions = 1, .widestCone = Angle::fromDegrees(180)});
  expectDiscs(mesh, regions);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) EXPECT_EQ(regions.ofTriangle[t] == 0, t < 32);
}

TEST(Regions, AFinStaysApart) {
  // A second patch stands on a line of edges of the first.
  TriangleMesh mesh = squarePatch(6);
  TriangleMesh fin = squarePatch(6);
  for (auto& p : fin.positions) p = {p.x(), 0.5f, p.y()};
  mesh = together(mesh, fin);
  const Regions regions = regionsOf(mesh, {.regions = 1, .widestCone = Angle::fromDegrees(180)});
  EXPECT_EQ(regions.count, 3u); // both sides of the line, and the fin
  expectDiscs(mesh, regions);
}

TEST(Regions, ATriangleWoundTheOtherWayStaysApart) {
  TriangleMesh mesh = squarePatch(6);
  std::swap(mesh.triangles[40][0], mesh.triangles[40][1]);
  const Regions regions = regionsOf(mesh, {.regions = 1});
  expectDiscs(mesh, regions);
  EXPECT_EQ(std::ranges::count(regions.ofTriangle, regions.ofTriangle[40]), 1);
}

TEST(Regions, TrianglesWithoutAreaJoinANeighbor) {
  // A vertex of the patch lies on an edge: its triangles are flat.
  TriangleMesh mesh = squarePatch(10);
  const auto& a = mesh.positions[3 * 11 + 3];
  mesh.positions[3 * 11 + 4] = {a.x() + 0.15f, a.y(), 0};
  const Regions regions = regionsOf(mesh, {.regions = 8});
  EXPECT_EQ(regions.count, 8u);
  expectDiscs(mesh, regions);
  for (const double share : sharesOf(mesh, regions)) EXPECT_GT(share, 0.2);
}

TEST(Regions, AMeshWithoutAreaIsCutToo) {
  TriangleMesh mesh = squarePatch(6);
  for (auto& p : mesh.positions) p = {p.x() + 8 * p.y(), 0, 0}; // on a line
  const Regions regions = regionsOf(mesh, {.regions = 5});
  EXPECT_EQ(regions.count, 5u);
  expectDiscs(mesh, regions);
}

TEST(Regions, TinyTrianglesThatFaceElsewhereDoNotStayAlone) {
  // Needles that stand up from a flat patch and down again.
  TriangleMesh mesh = squarePatch(30);
  std::mt19937 random(1);
  for (int i = 0; i < 20; ++i) {
    const auto v = random() % mesh.positions.size();
    auto& p = mesh.positions[v];
    p = {p.x(), p.y(), 0.5f};
  }
  const Regions regions = regionsOf(mesh, {.regions = 20, .widestCone = Angle::fromDegrees(30)});
  expectDiscs(mesh, regions);
  EXPECT_LE(regions.count, 180u);
}

TEST(Regions, ASingleTriangleIsOne) {
  const TriangleMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}}, {{0, 1, 2}});
  const Regions regions = regionsOf(mesh);
  EXPECT_EQ(regions.ofTriangle, std::vector<uint32_t>{0});
  EXPECT_EQ(regions.count, 1u);
}

TEST(Regions, AMeshWithoutTrianglesIsRefused) {
  try {
    regionsOf({});
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "mesh: has no triangles");
  }
}

TEST(Regions, RandomTrianglesOverFewVerticesGiveDiscs) {
  // Every kind of edge and vertex that is not a surface's.
  std::mt19937 random(1);
  const auto below = [&](uint32_t n) { return static_cast<uint32_t>(random() % n); };
  for (int trial = 0; trial < 200; ++trial) {
    const uint32_t vertices = 4 + below(8);
    TriangleMesh mesh;
    for (uint32_t v = 0; v < vertices; ++v)
      mesh.positions.push_back(
          {static_cast<float>(below(97)), static_cast<float>(below(89)), static_cast<float>(v)});
    while (mesh.triangles.size() < 3 * vertices) {
      const uint32_t a = below(vertices), b = below(vertices), c = below(vertices);
      if (a != b && b != c && c != a) mesh.triangles.push_back({a, b, c});
    }
    const Regions regions =
        regionsOf(mesh, {.regions = 1 + random() % 4, .widestCone = Angle::fromDegrees(180)});
    expectDiscs(mesh, regions);
  }
}

TEST(Regions, CanBeCancelled) {
  Progress progress;
  progress.cancelled = [] { return true; };
  EXPECT_THROW(regionsOf(squarePatch(10), {}, progress), Cancelled);
}

TEST(RegionMoments, UnionCostIsTheGainOfTheSpread) {
  // E(A and B) - E(A) - E(B) of point masses, by definition.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  struct Piece {
    double area;
    Vec3<double> x, n;
  };
  const auto energyOf = [](const std::vector<Piece>& pieces, double squaredLength) {
    double area = 0, energy = 0;
    Vec3<double> x = Vec3<double>::Zero(), n = Vec3<double>::Zero();
    for (const Piece& piece : pieces)
      area += piece.area, x += piece.area * piece.x, n += piece.area * piece.n;
    for (const Piece& piece : pieces)
      energy += piece.area *
                ((piece.x - x / area).squaredNorm() / squaredLength + (piece.n - n / area).squaredNorm());
    return energy;
  };
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<Piece> a, b;
    RegionMoments momentsA, momentsB;
    for (int i = 0; i < 5; ++i)
      for (const bool first : {true, false}) {
        const Piece piece{0.1 + std::abs(number(random)),
                          {number(random), number(random), number(random)},
                          Vec3<double>(number(random), number(random), number(random)).normalized()};
        (first ? a : b).push_back(piece);
        RegionMoments& moments = first ? momentsA : momentsB;
        moments = moments + RegionMoments{piece.area, piece.area * piece.x, piece.area * piece.n};
      }
    const double squaredLength = 0.1 + std::abs(number(random));
    std::vector<Piece> both = a;
    both.insert(both.end(), b.begin(), b.end());
    EXPECT_NEAR(unionCost(momentsA, momentsB, squaredLength),
                energyOf(both, squaredLength) - energyOf(a, squaredLength) - energyOf(b, squaredLength),
                1e-11);
  }
}

TEST(RegionMoments, PartsWithoutAreaCostNothing) {
  const RegionMoments some{1, {1, 2, 3}, {0, 0, 1}};
  EXPECT_EQ(unionCost(some, {}, 1), 0);
  EXPECT_EQ(unionCost({}, {}, 1), 0);
}

} // namespace

} // namespace surflect::slf
