#include "render/lightfield/slf/direction_mesh.h"

#include "tests/srf/image/files.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace surflect::slf {
namespace {

std::vector<Direction> randomDirections(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Direction> directions;
  for (size_t i = 0; i < count; ++i) directions.push_back(assume<Direction>(randomUnit(random)));
  return directions;
}

std::vector<DirectionMesh> meshes() {
  std::vector<DirectionMesh> result;
  result.emplace_back(octahedronDirections(0));
  result.emplace_back(octahedronDirections(2));
  result.emplace_back(randomDirections(40, 1));
  result.emplace_back(randomDirections(300, 2));
  return result;
}

double determinant(const Direction& a, const Direction& b, const Direction& c) {
  return a.raw().dot(b.raw().cross(c.raw()));
}

// Least of the three sides of a triangle's cone that a direction is on; not below 0 inside.
double depthIn(const DirectionMesh& mesh, size_t triangle, const Direction& r) {
  const auto& [a, b, c] = mesh.triangles()[triangle];
  const auto d = mesh.directions();
  return std::min({determinant(r, d[a], d[b]), determinant(r, d[b], d[c]), determinant(r, d[c], d[a])});
}

double hatOf(const DirectionMesh& mesh, uint32_t direction, const Direction& r) {
  const HatWeights hats = mesh.weightsAt(r);
  for (size_t corner = 0; corner < 3; ++corner)
    if (hats.directions[corner] == direction) return hats.weights[corner];
  return 0;
}

std::string errorOfMesh(const std::vector<Direction>& directions) {
  return image::errorOf([&] { DirectionMesh mesh(directions); });
}

TEST(DirectionMesh, SubdividedOctahedraHaveTheirNumbersOfDirectionsAndTriangles) {
  size_t directions = 6, triangles = 8;
  for (int level = 0; level <= 3; ++level) {
    const DirectionMesh mesh(octahedronDirections(level));
    EXPECT_EQ(mesh.directions().size(), directions);
    EXPECT_EQ(mesh.triangles().size(), triangles);
    triangles *= 4;
    directions = triangles / 2 + 2; // Euler
  }
}

std::string errorOfTriangles(std::span<const Direction> directions,
                             const std::vector<std::array<uint32_t, 3>>& triangles) {
  return image::errorOf([&] { DirectionMesh({directions.begin(), directions.end()}, triangles); });
}

TEST(DirectionMesh, StoredTrianglesComeBack) {
  for (const DirectionMesh& mesh : meshes()) {
    const DirectionMesh stored({mesh.directions().begin(), mesh.directions().end()},
                               {mesh.triangles().begin(), mesh.triangles().end()});
    EXPECT_TRUE(std::ranges::equal(stored.triangles(), mesh.triangles()));
    for (size_t t = 0; t < mesh.triangles().size(); ++t) EXPECT_EQ(stored.neighbors(t), mesh.neighbors(t));
  }
}

// The corners of a cube: its faces may be cut along either diagonal.
TEST(DirectionMesh, EitherDiagonalOfAFlatFaceIsKept) {
  std::vector<Direction> corners;
  for (const double x : {-1, 1})
    for (const double y : {-1, 1})
      for (const double z : {-1, 1}) corners.push_back(normalized(assume<Direction>(Vec3<double>(x, y, z))));
  const DirectionMesh hull(corners);
  std::vector<std::array<uint32_t, 3>> triangles(hull.triangles().begin(), hull.triangles().end());
  // Flips the diagonal that the first triangle shares with the other one of its face.
  for (size_t corner = 0; corner < 3; ++corner) {
    const uint32_t other = hull.neighbors(0)[corner];
    const auto [a, b, c] =
        std::array{triangles[0][corner], triangles[0][(corner + 1) % 3], triangles[0][(corner + 2) % 3]};
    const uint32_t d = *std::ranges::find_if(triangles[other], [&](uint32_t v) { return v != b && v != c; });
    const auto at = [&](uint32_t v) { return corners[v].raw(); };
    if (std::abs((at(b) - at(a)).cross(at(c) - at(a)).dot(at(d) - at(a))) > 1e-9) continue; // another face
    triangles[0] = {a, b, d};
    triangles[other] = {a, d, c};
    EXPECT_TRUE(std::ranges::equal(DirectionMesh(corners, triangles).triangles(), triangles));
    return;
  }
  FAIL() << "no flat face";
}

TEST(DirectionMesh, TrianglesThatDoNotCoverTheSphereOnceAreRefused) {
  const DirectionMesh mesh(octahedronDirections(1));
  const std::vector<std::array<uint32_t, 3>> right(mesh.triangles().begin(), mesh.triangles().end());
  auto triangles = right;
  std::swap(triangles[3][0], triangles[3][1]);
  EXPECT_NE(errorOfTriangles(mesh.directions(), triangles).find("triangles[3]: is not counter-clockwise"),
            std::string::npos);
  triangles = right;
  triangles[5] = triangles[6];
  EXPECT_NE(errorOfTriangles(mesh.directions(), triangles).find("triangles"), std::string::npos);
  triangles = right;
  triangles.pop_back();
  EXPECT_NE(errorOfTriangles(mesh.directions(), triangles).find("expected the sphere, once"),
            std::string::npos);
  triangles = right;
  triangles.insert(triangles.end(), right.begin(), right.end());
  EXPECT_NE(errorOfTriangles(mesh.directions(), triangles).find("found 2 of it"), std::string::npos);
}

TEST(DirectionMesh, ACoarserOctahedronIsTheStartOfAFinerOne) {
  const auto coarse = octahedronDirections(1), fine = octahedronDirections(3);
  EXPECT_TRUE(std::ranges::equal(coarse, std::span(fine).first(coarse.size())));
}

TEST(DirectionMesh, TrianglesCoverTheSphereOnce) {
  for (const DirectionMesh& mesh : meshes()) {
    EXPECT_EQ(mesh.triangles().size(), 2 * mesh.directions().size() - 4);
    double solidAngle = 0;
    for (const auto& [a, b, c] : mesh.triangles()) {
      // [Van Oosterom and Strackee 1983] The Solid Angle of a Plane Triangle.
      const Vec3<double> u = mesh.directions()[a].raw(), v = mesh.directions()[b].raw(),
                         w = mesh.directions()[c].raw();
      solidAngle += 2 * std::atan2(u.dot(v.cross(w)), 1 + u.dot(v) + v.dot(w) + w.dot(u));
    }
    EXPECT_NEAR(solidAngle, 4 * std::numbers::pi, 1e-9);
  }
}

TEST(DirectionMesh, NoDirectionLiesInTheCircleOfAnotherTriangle) {
  const DirectionMesh mesh(randomDirections(100, 3));
  for (const auto& [a, b, c] : mesh.triangles()) {
    const Vec3<double> p = mesh.directions()[a].raw();
    const Vec3<double> axis =
        (mesh.directions()[b].raw() - p).cross(mesh.directions()[c].raw() - p).normalized();
    for (const Direction& other : mesh.directions()) EXPECT_LE(axis.dot(other.raw()), axis.dot(p) + 1e-12);
  }
}

TEST(DirectionMesh, NeighboursShareTheEdgeOppositeToTheCorner) {
  for (const DirectionMesh& mesh : meshes())
    for (size_t t = 0; t < mesh.triangles().size(); ++t)
      for (size_t corner = 0; corner < 3; ++corner) {
        const auto& other = mesh.triangles()[mesh.neighbors(t)[corner]];
        const uint32_t from = mesh.triangles()[t][(corner + 1) % 3],
                       to = mesh.triangles()[t][(corner + 2) % 3];
        const auto place = std::ranges::find(other, to);
        ASSERT_NE(place, other.end());
        EXPECT_EQ(other[static_cast<size_t>(place - other.begin() + 1) % 3], from);
      }
}

TEST(DirectionMesh, HatsAreAPartitionOfUnity) {
  std::mt19937 random(4);
  for (const DirectionMesh& mesh : meshes())
    for (int i = 0; i < 500; ++i) {
      const HatWeights hats = mesh.weightsAt(assume<Direction>(randomUnit(random)));
      double sum = 0;
      for (const double weight : hats.weights) {
        EXPECT_GE(weight, 0);
        sum += weight;
      }
      EXPECT_NEAR(sum, 1, 1e-15);
    }
}

TEST(DirectionMesh, AHatIsOneAtItsOwnDirection) {
  for (const DirectionMesh& mesh : meshes())
    for (uint32_t i = 0; i < mesh.directions().size(); ++i)
      EXPECT_NEAR(hatOf(mesh, i, mesh.directions()[i]), 1, 1e-12);
}

TEST(DirectionMesh, HatsReproduceThePointWhereTheRayMeetsTheTriangle) {
  std::mt19937 random(5);
  for (const DirectionMesh& mesh : meshes())
    for (int i = 0; i < 200; ++i) {
      const Direction r = assume<Direction>(randomUnit(random));
      const HatWeights hats = mesh.weightsAt(r);
      Vec3<double> point = Vec3<double>::Zero();
      for (size_t corner = 0; corner < 3; ++corner)
        point += hats.weights[corner] * mesh.directions()[hats.directions[corner]].raw();
      EXPECT_NEAR((point.normalized() - r.raw()).norm(), 0, 1e-12);
    }
}

TEST(DirectionMesh, HatsAreContinuousAcrossEdges) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit;
  for (const DirectionMesh& mesh : meshes())
    for (int i = 0; i < 100; ++i) {
      const auto& corners = mesh.triangles()[random() % mesh.triangles().size()];
      const Vec3<double> a = mesh.directions()[corners[0]].raw(), b = mesh.directions()[corners[1]].raw(),
                         inside = mesh.directions()[corners[2]].raw();
      const Vec3<double> onEdge = a + unit(random) * (b - a);
      constexpr double kStep = 1e-9;
      const auto here = normalized(assume<Direction>(onEdge + kStep * (inside - onEdge))),
                 there = normalized(assume<Direction>(onEdge - kStep * (inside - onEdge)));
      for (uint32_t d = 0; d < mesh.directions().size(); ++d)
        EXPECT_NEAR(hatOf(mesh, d, here), hatOf(mesh, d, there), 1e-7);
    }
}

TEST(DirectionMesh, TheWalkFindsTheTriangleOfBruteForceFromEveryStart) {
  std::mt19937 random(7);
  for (const DirectionMesh& mesh : meshes())
    for (int i = 0; i < 20; ++i) {
      const Direction r = assume<Direction>(randomUnit(random));
      size_t deepest = 0;
      for (size_t t = 0; t < mesh.triangles().size(); ++t)
        if (depthIn(mesh, t, r) > depthIn(mesh, deepest, r)) deepest = t;
      ASSERT_GE(depthIn(mesh, deepest, r), 0);
      for (uint32_t start = 0; start < mesh.triangles().size(); ++start)
        EXPECT_EQ(mesh.triangleAt(r, start), deepest);
    }
}

TEST(DirectionMesh, TheReversedMeshHasTheOppositeHats) {
  // B'_i(r) = B_i(-r)  [Azuma 1999, §2.3]
  std::mt19937 random(8);
  const std::vector<Direction> directions = randomDirections(60, 9);
  std::vector<Direction> opposite;
  for (const Direction& direction : directions) opposite.push_back(-direction);
  const DirectionMesh mesh(directions), reversed(opposite);
  for (int i = 0; i < 100; ++i) {
    const Direction r = assume<Direction>(randomUnit(random));
    for (uint32_t d = 0; d < directions.size(); ++d)
      EXPECT_NEAR(hatOf(mesh, d, r), hatOf(reversed, d, -r), 1e-12);
  }
}

TEST(DirectionMesh, TheOrderOfDirectionsDoesNotChangeTheHats) {
  const std::vector<Direction> directions = randomDirections(60, 10);
  const DirectionMesh mesh(directions);
  std::mt19937 random(11);
  std::vector<uint32_t> order(directions.size());
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::shuffle(order, random);
  std::vector<Direction> shuffled;
  for (const uint32_t i : order) shuffled.push_back(directions[i]);
  const DirectionMesh other(shuffled);
  for (int i = 0; i < 100; ++i) {
    const Direction r = assume<Direction>(randomUnit(random));
    for (uint32_t d = 0; d < order.size(); ++d)
      EXPECT_NEAR(hatOf(other, d, r), hatOf(mesh, order[d], r), 1e-12);
  }
}

TEST(DirectionMesh, EqualDirectionsAreRefusedByTheirIndices) {
  std::vector<Direction> directions = octahedronDirections(1);
  directions.push_back(directions[3]);
  EXPECT_EQ(errorOfMesh(directions), "directions[18]: equals directions[3]");
}

TEST(DirectionMesh, DirectionsOnOneGreatCircleAreRefusedWithoutPrinting) {
  std::vector<Direction> directions;
  for (int i = 0; i < 8; ++i) directions.emplace_back(std::cos(0.7 * i), std::sin(0.7 * i), 0);
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(errorOfMesh(directions), "directions: lie in a plane");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

TEST(DirectionMesh, DirectionsInOneHemisphereAreRefused) {
  std::vector<Direction> directions;
  for (const Direction& direction : randomDirections(50, 12))
    directions.emplace_back(direction.x(), direction.y(), std::abs(direction.z()));
  EXPECT_NE(errorOfMesh(directions).find("hemisphere"), std::string::npos);
  // Also a closed hemisphere, whose border is a face of the hull.
  directions = octahedronDirections(1);
  std::erase_if(directions, [](const Direction& direction) { return direction.z() < 0; });
  EXPECT_NE(errorOfMesh(directions).find("hemisphere"), std::string::npos);
}

TEST(DirectionMesh, FewerThanFourDirectionsAreRefused) {
  std::vector<Direction> directions = octahedronDirections(0);
  directions.resize(3);
  EXPECT_EQ(errorOfMesh(directions), "directions: found 3, expected at least 4");
  EXPECT_EQ(errorOfMesh({}), "directions: found 0, expected at least 4");
}

TEST(DirectionMesh, DirectionsThatAreNotUnitOrNotFiniteAreRefusedByTheirIndex) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                   kInfinity = std::numeric_limits<double>::infinity();
  for (const Direction& wrong : {Direction(0, 0, 0), Direction(0, 0, 2), Direction(kNan, 0, 1),
                                 Direction(0, kInfinity, 0), Direction(1e200, 0, 0)}) {
    std::vector<Direction> directions = octahedronDirections(1);
    directions[5] = wrong;
    EXPECT_NE(errorOfMesh(directions).find("directions[5]: found length"), std::string::npos);
  }
}

TEST(DirectionMesh, ANaNDirectionIsAnsweredByATriangle) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const DirectionMesh mesh(octahedronDirections(2));
  EXPECT_LT(mesh.triangleAt(Direction(kNan, kNan, kNan), 7), mesh.triangles().size());
}

} // namespace
} // namespace surflect::slf
