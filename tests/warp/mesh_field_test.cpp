#include "warp/mesh_field.h"

#include "surfel/base/error.h"
#include "tests/warp/meshes.h"
#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

#include <set>

namespace surflect::warp {

namespace {

TEST(BallTree, VisitsEveryBallThatHoldsThePointOnce) {
  std::mt19937 random(1);
  for (const size_t count : {0, 1, 8, 9, 300}) {
    const auto centers = randomPoints(count, random);
    std::vector<double> radii;
    for (size_t i = 0; i < count; ++i) radii.push_back(std::pow(10, randomBetween(-3, 0.5, random)));
    const BallTree tree(centers, radii);
    for (int trial = 0; trial < 200; ++trial) {
      const Vec3<double> x =
          trial % 2 && count ? centers[random() % count] : Vec3<double>(2 * randomVector(random));
      std::set<uint32_t> visited;
      tree.forEachNear(x, [&](uint32_t i) { EXPECT_TRUE(visited.insert(i).second); });
      for (uint32_t i = 0; i < count; ++i)
        if ((x - centers[i]).norm() <= radii[i]) {
          EXPECT_TRUE(visited.contains(i));
        }
    }
  }
}

TEST(BallTree, PassesOverBallsThatAreFarAway) {
  std::mt19937 random(2);
  const auto centers = randomPoints(10000, random);
  const BallTree tree(centers, std::vector<double>(centers.size(), 0.02));
  size_t visits = 0;
  for (int trial = 0; trial < 100; ++trial)
    tree.forEachNear(randomVector(random), [&](uint32_t) { ++visits; });
  EXPECT_LT(visits, 100 * 40); // about 0.3 balls hold a point; leaves have 8
}

} // namespace

namespace {

std::vector<Vec3<double>> moved(const TriangleMesh& mesh, const Warp& warp) {
  std::vector<Vec3<double>> positions = positionsOf(mesh);
  for (Vec3<double>& p : positions) p = warp.position(p);
  return positions;
}

// From on the torus to far away from it.
Vec3<double> somewhere(int trial, std::mt19937& random) {
  if (trial % 3 == 0) return 3 * randomVector(random);
  const double gap = randomBetween(-0.1, trial % 3 == 1 ? 0.1 : 0.5, random);
  return torusPoint(randomBetween(0, 1, random), randomBetween(0, 1, random), 0.25 + gap);
}

WarpPointer randomField(std::mt19937& random) {
  const TriangleMesh mesh = torus(12, 6);
  auto positions = positionsOf(mesh);
  for (Vec3<double>& p : positions) p += 0.05 * randomVector(random);
  return fieldOf(mesh).follow(positions);
}

TEST(MeshField, AMeshAtRestMovesNothing) {
  std::mt19937 random(1);
  const TriangleMesh mesh = torus(16, 8);
  const WarpPointer warp = fieldOf(mesh).follow(positionsOf(mesh));
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> x = somewhere(i, random);
    EXPECT_LT((warp->position(x) - x).norm(), 2e-14);
    EXPECT_LT((*warp->jacobian(x) - Mat3<double>::Identity()).norm(), 1e-12);
  }
}

// Weights sum to one, and each vertex's map rotates like the mesh.
TEST(MeshField, RigidMotionAndEvenScalingOfTheMeshMoveAllSpaceSo) {
  std::mt19937 random(2);
  const TriangleMesh mesh = torus(16, 8);
  const MeshField field = fieldOf(mesh);
  for (int i = 0; i < 300; ++i) {
    const double scale = randomBetween(0.2, 3, random);
    const WarpPointer similar =
        chainOf(scaleWarp({scale, scale, scale}, randomVector(random)), randomRigid(random));
    const WarpPointer warp = field.follow(moved(mesh, *similar));
    const Vec3<double> x = somewhere(i, random);
    EXPECT_LT((warp->position(x) - similar->position(x)).norm(), 1e-13);
    EXPECT_LT((*warp->jacobian(x) - *similar->jacobian(x)).norm(), 3e-12);
  }
}

TEST(MeshField, ItsJacobianIsThatOfItsPositionEverywhere) {
  std::mt19937 random(3);
  for (int i = 0; i < 300; ++i) {
    const WarpPointer warp = randomField(random);
    const Vec3<double> x = somewhere(i, random);
    const Mat3<double> differences = centralDifferences(*warp, x, Mat3<double>::Identity(), 1e-6);
    EXPECT_LT((differences - *warp->jacobian(x)).norm(), 2e-8);
  }
}

TEST(MeshField, PositionAndJacobianAreContinuousEverywhere) {
  std::mt19937 random(4);
  const WarpPointer warp = randomField(random);
  for (int i = 0; i < 3000; ++i) {
    const Vec3<double> x = somewhere(i, random), step = 1e-7 * randomUnit(random);
    EXPECT_LT((warp->position(x + step) - warp->position(x - step)).norm(), 1e-6);
    EXPECT_LT((*warp->jacobian(x + step) - *warp->jacobian(x - step)).norm(), 1e-5);
  }
}

// From on a mesh of many sizes of groups to where the largest does not reach.
TEST(MeshField, BetweenGroupsOfAnySizeItsJacobianIsExactAndContinuous) {
  std::mt19937 random(10);
  const TriangleMesh mesh = torus(48, 24);
  auto positions = positionsOf(mesh);
  for (Vec3<double>& p : positions)
    p += 0.1 * p[0] * p[0] * Vec3<double>::UnitZ() + 0.02 * randomVector(random);
  const WarpPointer warp = fieldOf(mesh).follow(positions);
  for (int i = 0; i < 3000; ++i) {
    const double gap = std::pow(10, randomBetween(-3, 0.7, random));
    const Vec3<double> x = torusPoint(randomBetween(0, 1, random), randomBetween(0, 1, random), 0.25 + gap);
    const Mat3<double> jacobian = *warp->jacobian(x);
    EXPECT_LT((centralDifferences(*warp, x, Mat3<double>::Identity(), 1e-6) - jacobian).norm(), 1e-7);
    EXPECT_LT((*warp->jacobian(x + 1e-7 * randomUnit(random)) - jacobian).norm(), 2e-5);
  }
}

TEST(MeshField, FarAwaySpaceFollowsTheMeanOfTheMesh) {
  std::mt19937 random(11);
  const WarpPointer warp = randomField(random);
  const Mat3<double> mean = *warp->jacobian({100, 0, 0});
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> from = 20 * randomUnit(random), to = 90 * randomUnit(random);
    EXPECT_LT((warp->position(to) - warp->position(from) - mean * (to - from)).norm(), 1e-11);
  }
}

// Any number of vertices.
TEST(MeshField, WhatAPointCostsHardlyGrowsWithTheMesh) {
  std::mt19937 random(12);
  for (const int finer : {4, 16}) {
    const TriangleMesh mesh = torus(12 * finer, 6 * finer);
    const MeshField field = fieldOf(mesh);
    for (int i = 0; i < 3000; ++i) {
      const double gap = std::pow(10, randomBetween(-3, 2, random));
      const Vec3<double> x = torusPoint(randomBetween(0, 1, random), randomBetween(0, 1, random), 0.25 + gap);
      EXPECT_LT(field.kernelsAt(x), 300); // of 1,152 and 18,432
    }
  }
}

TEST(MeshField, ReachesWhatIsWithinTwiceItsEdges) {
  std::mt19937 random(13);
  const TriangleMesh mesh = torus(48, 24); // edges of 0.04 to 0.13
  const MeshField field = fieldOf(mesh);
  for (int i = 0; i < 300; ++i) {
    const double u = randomBetween(0, 1, random), v = randomBetween(0, 1, random);
    EXPECT_TRUE(field.reaches(torusPoint(u, v, 0.25 + randomBetween(-0.05, 0.05, random))));
    EXPECT_FALSE(field.reaches(torusPoint(u, v, 0.25 + randomBetween(0.3, 5, random))));
  }
}

// The cells of groups must come to hold all, wherever the mesh lies and however its sizes differ.
TEST(MeshField, MeshesOfVeryDifferentSizesAreGrouped) {
  std::vector<Vec3<double>> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
  for (const double size : {1e-30, 1e-3, 1., 1e6})
    for (const Vec3<double>& corner :
         {Vec3<double>(-1, 0, 0), Vec3<double>(1, -1, 0), Vec3<double>(0, 1, 1)}) {
      if (positions.size() % 3 == 0) {
        const auto next = static_cast<uint32_t>(positions.size());
        triangles.push_back({next, next + 1, next + 2});
      }
      positions.push_back(size * corner);
    }
  const WarpPointer warp = MeshField(positions, triangles).follow(positions);
  for (const double distance : {0., 1e-30, 1e-3, 0.1, 1., 1e3, 1e9}) {
    const Vec3<double> x(distance, -distance, distance);
    EXPECT_LE((warp->position(x) - x).norm(), 1e-15 * std::max(1e6, distance));
  }
}

struct Errors {
  double position = 0, tangents = 0; // root mean square
};

// Errors of the field of a mesh that a warp has moved, against the warp, at some distance from the mesh.
// Tangents are those of the surface, because a mesh does not determine shear and stretch across it.
Errors errorsOf(const Warp& truth, int around, int through, double gap = 0) {
  std::mt19937 random(5);
  const TriangleMesh mesh = torus(around, through);
  const WarpPointer field = fieldOf(mesh).follow(moved(mesh, truth));
  constexpr int samples = 3000;
  Errors errors;
  for (int i = 0; i < samples; ++i) {
    const double u = randomBetween(0, 1, random), v = randomBetween(0, 1, random);
    const Vec3<double> x = torusPoint(u, v, 0.25 + gap);
    const Vec3<double> n = (torusPoint(u, v, 0.26 + gap) - x).normalized();
    const Mat3<double> difference = *field->jacobian(x) - *truth.jacobian(x);
    errors.position += (field->position(x) - truth.position(x)).squaredNorm() / samples;
    errors.tangents += (difference * (Mat3<double>::Identity() - n * n.transpose())).squaredNorm() / samples;
  }
  return {std::sqrt(errors.position), std::sqrt(errors.tangents)};
}

TEST(MeshField, ComesToTheWarpThatMovedTheMeshAsTheMeshGetsFiner) {
  const WarpPointer twist = twistWarp({0, 0, 1}, Angle::fromDegrees(60), {0, 0, 0});
  const WarpPointer bend = bendWarp({1, 0, 0}, {0, 0, 1}, Angle::fromDegrees(60), {0, 0, 0});
  for (const Warp* truth : {twist.get(), bend.get()}) {
    const Errors coarse = errorsOf(*truth, 48, 20), fine = errorsOf(*truth, 192, 80);
    EXPECT_LT(coarse.position, 0.003);
    EXPECT_LT(coarse.tangents, 0.02);
    EXPECT_LT(fine.position, coarse.position / 12);
    EXPECT_LT(fine.tangents, coarse.tangents / 8);
  }
}

// For comparison, the mean of all vertices weighted by the sixth power of distance has 0.015 and 0.061.
TEST(MeshField, FurtherAwayItFollowsTheWarpByTheDistanceNotByTheMesh) {
  const WarpPointer bend = bendWarp({1, 0, 0}, {0, 0, 1}, Angle::fromDegrees(60), {0, 0, 0});
  for (const int finer : {4, 16}) {
    EXPECT_LT(errorsOf(*bend, 12 * finer, 6 * finer, 0.1).position, 0.017);
    EXPECT_LT(errorsOf(*bend, 12 * finer, 6 * finer, 0.3).position, 0.065);
  }
}

TEST(MeshField, VerticesThatAreSplitAtASeamAreOne) {
  std::mt19937 random(6);
  const TriangleMesh mesh = torus(12, 6);
  TriangleMesh split;
  std::vector<uint32_t> originals;
  for (const auto& triangle : mesh.triangles) {
    const auto next = static_cast<uint32_t>(split.positions.size());
    split.triangles.push_back({next, next + 1, next + 2});
    for (const uint32_t corner : triangle) {
      split.positions.push_back(mesh.positions[corner]);
      originals.push_back(corner);
    }
  }
  auto positions = positionsOf(mesh);
  for (Vec3<double>& p : positions) p += 0.05 * randomVector(random);
  std::vector<Vec3<double>> splitPositions;
  for (const uint32_t original : originals) splitPositions.push_back(positions[original]);
  const WarpPointer one = fieldOf(mesh).follow(positions), other = fieldOf(split).follow(splitPositions);
  for (int i = 0; i < 300; ++i) {
    const Vec3<double> x = somewhere(i, random);
    EXPECT_LT((one->position(x) - other->position(x)).norm(), 1e-13);
  }
}

TEST(MeshField, WhatIsFarFromAVertexDoesNotFollowIt) {
  std::mt19937 random(7);
  const TriangleMesh mesh = torus(48, 20);
  const MeshField field = fieldOf(mesh);
  auto positions = positionsOf(mesh);
  for (Vec3<double>& p : positions)
    if (p[0] > 0.4) p += 0.1 * randomVector(random);
  const WarpPointer warp = field.follow(positions);
  for (int i = 0; i < 300; ++i) {
    const Vec3<double> x = torusPoint(randomBetween(0.3, 0.7, random), randomBetween(0, 1, random), 0.27);
    EXPECT_LT((warp->position(x) - x).norm(), 1e-14);
  }
}

TEST(MeshField, AMeshThatShrinksToAPointTakesSpaceThere) {
  std::mt19937 random(8);
  const TriangleMesh mesh = torus(12, 6);
  const Vec3<double> point(1, 2, 3);
  const WarpPointer warp = fieldOf(mesh).follow(std::vector<Vec3<double>>(mesh.positions.size(), point));
  const Vec3<double> x = torusPoint(0.1, 0.2);
  EXPECT_LT((warp->position(x) - point).norm(), 1e-14);
  EXPECT_LT(warp->jacobian(x)->norm(), 1e-13);
}

TEST(MeshField, LooseVerticesAndTrianglesWithoutAreaDoNotMatter) {
  std::mt19937 random(9);
  TriangleMesh mesh = torus(12, 6);
  auto positions = positionsOf(mesh);
  for (Vec3<double>& p : positions) p += 0.05 * randomVector(random);
  const WarpPointer before = fieldOf(mesh).follow(positions);
  mesh.triangles.push_back({3, 4, 3});
  mesh.positions.emplace_back(9.f, 9.f, 9.f);
  positions.emplace_back(0, 0, 0);
  const WarpPointer after = fieldOf(mesh).follow(positions);
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> x = somewhere(i, random);
    EXPECT_EQ(before->position(x), after->position(x));
  }
  EXPECT_THROW(fieldOf(TriangleMesh{mesh.positions, {{3, 4, 3}}}), Error);
}

} // namespace

} // namespace surflect::warp
