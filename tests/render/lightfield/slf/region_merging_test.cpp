#include "render/lightfield/slf/region_merging.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

using Loop = std::vector<uint32_t>;

// Union with no pinched place; checks that scratch memory is left clean.
Loop united(const Loop& a, const Loop& b, size_t sharedEdges, std::vector<uint8_t> isPinched = {}) {
  isPinched.resize(20, 0);
  std::vector<uint32_t> order(20, 0);
  const Loop loop = unitedLoop(a, b, sharedEdges, isPinched, order);
  EXPECT_EQ(std::ranges::count(order, 0u), 20);
  return loop;
}

// Loop that starts at its lowest place.
Loop rotated(Loop loop) {
  std::ranges::rotate(loop, std::ranges::min_element(loop));
  return loop;
}

TEST(RegionMerging, LoopsUniteAlongOnePathWhereverTheyStart) {
  for (size_t i = 0; i < 5; ++i)
    for (size_t j = 0; j < 4; ++j) {
      Loop a = {0, 1, 2, 3, 4}, b = {3, 2, 1, 5};
      std::ranges::rotate(a, a.begin() + static_cast<ptrdiff_t>(i));
      std::ranges::rotate(b, b.begin() + static_cast<ptrdiff_t>(j));
      EXPECT_EQ(rotated(united(a, b, 2)), (Loop{0, 1, 5, 3, 4}));
      EXPECT_EQ(rotated(united(b, a, 2)), (Loop{0, 1, 5, 3, 4}));
    }
}

TEST(RegionMerging, TrianglesUniteToAQuadrangle) {
  EXPECT_EQ(rotated(united({0, 1, 2}, {2, 1, 3}, 1)), (Loop{0, 1, 3, 2}));
}

TEST(RegionMerging, ATriangleFillsANotchOfTwoEdges) {
  EXPECT_EQ(rotated(united({0, 1, 2, 3}, {2, 1, 0}, 2)), (Loop{0, 2, 3}));
}

TEST(RegionMerging, LoopsThatTouchAtAFurtherPlaceStayApart) {
  EXPECT_TRUE(united({0, 1, 2, 3, 4}, {2, 1, 5, 4}, 1).empty()); // would be a ring, or pinched at 4
}

TEST(RegionMerging, LoopsThatShareTwoPathsStayApart) {
  EXPECT_TRUE(united({0, 1, 2, 3, 4, 5}, {1, 0, 4, 3}, 2).empty());
}

TEST(RegionMerging, ClosedSurfacesStayOpen) {
  EXPECT_TRUE(united({0, 1, 2}, {2, 1, 0}, 3).empty());
  EXPECT_TRUE(united({0, 1, 2}, {2, 1, 0}, 2).empty()); // the third edge is not shared, but has the same ends
}

TEST(RegionMerging, PinchedPlacesStayOnTheBorder) {
  EXPECT_TRUE(united({0, 1, 2, 3, 4}, {3, 2, 1, 5}, 2, {0, 0, 1}).empty());
  EXPECT_FALSE(united({0, 1, 2, 3, 4}, {3, 2, 1, 5}, 2, {0, 1, 0, 1}).empty());
}

TEST(RegionMerging, LoopsWithoutASharedEdgeStayApart) {
  EXPECT_TRUE(united({0, 1, 2}, {2, 3, 4}, 0).empty());
}

TEST(RegionMerging, UnionCostIsTheGainOfTheSpread) {
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

TEST(RegionMerging, PartsWithoutAreaCostNothing) {
  const RegionMoments some{1, {1, 2, 3}, {0, 0, 1}};
  EXPECT_EQ(unionCost(some, {}, 1), 0);
  EXPECT_EQ(unionCost({}, {}, 1), 0);
}

} // namespace
} // namespace surflect::slf
