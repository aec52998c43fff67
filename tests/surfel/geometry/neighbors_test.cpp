#include "surfel/geometry/neighbors.h"

#include "tests/support/patience.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace surflect {
namespace {

using Points = std::vector<Point3<AcquisitionSpace>>;

Points randomPoints(size_t count, std::mt19937& random) {
  std::uniform_real_distribution<float> place(-1, 1);
  Points points;
  for (size_t i = 0; i < count; ++i) points.emplace_back(place(random), place(random), place(random));
  return points;
}

constexpr std::ptrdiff_t kMost = 40;

// Distances to all points with their indices; the first kMost + 1 are the nearest, nearest first.
std::vector<std::pair<float, uint32_t>> distancesTo(const Points& points, const Point3<AcquisitionSpace>& p) {
  std::vector<std::pair<float, uint32_t>> distances;
  for (uint32_t i = 0; i < points.size(); ++i)
    distances.emplace_back((points[i].raw().cast<double>() - p.raw().cast<double>()).norm(), i);
  std::ranges::partial_sort(distances, distances.begin() + std::min(kMost + 1, std::ssize(distances)));
  return distances;
}

void expectSameAsBruteForce(const Points& points, const NeighborIndex& index, int queries,
                            std::mt19937& random) {
  for (const auto& p : randomPoints(static_cast<size_t>(queries), random)) {
    const auto all = distancesTo(points, p);
    const auto nearest = index.nearest(p, 13);
    ASSERT_EQ(nearest.size(), std::min<size_t>(13, points.size()));
    for (size_t i = 0; i < nearest.size(); ++i) EXPECT_NEAR(nearest[i].distance, all[i].first, 1e-6);
    const size_t count = std::min<size_t>(kMost, points.size() - 1);
    const float radius = (all[count - 1].first + all[count].first) / 2;
    auto within = index.within(p, radius);
    ASSERT_EQ(within.size(), count);
    EXPECT_TRUE(std::ranges::is_sorted(within, {}, &NeighborIndex::Neighbor::index));
    std::ranges::sort(within, {}, &NeighborIndex::Neighbor::distance);
    for (size_t i = 0; i < count; ++i) EXPECT_NEAR(within[i].distance, all[i].first, 1e-6);
  }
}

TEST(Neighbors, AreThoseOfBruteForce) {
  std::mt19937 random(1);
  for (const size_t count : {2, 10, 1000}) {
    const Points points = randomPoints(count, random);
    expectSameAsBruteForce(points, NeighborIndex(points), 100, random);
  }
}

TEST(Neighbors, AreThoseOfBruteForceInManyTrees) {
  std::mt19937 random(2);
  Points points = randomPoints(2005, random);                         // the last tree has five
  std::ranges::sort(points, {}, [](const auto& p) { return p.x(); }); // slabs
  expectSameAsBruteForce(points, NeighborIndex(points, {}, 500), 100, random);
  std::ranges::shuffle(points, random);
  expectSameAsBruteForce(points, NeighborIndex(points, {}, 500), 100, random);
}

TEST(Neighbors, OfNobodyAreNone) {
  const NeighborIndex index{Points()};
  EXPECT_TRUE(index.nearest({0, 0, 0}, 3).empty());
  EXPECT_TRUE(index.within({0, 0, 0}, 3).empty());
  const NeighborIndex one(Points{{1, 0, 0}});
  EXPECT_TRUE(one.nearest({0, 0, 0}, 0).empty());
}

TEST(Neighbors, AnIndexOfManyTreesIsGivenUpAtOnce) {
  std::mt19937 random(3);
  const Points points = randomPoints(1100, random);
  Patience whole(std::numeric_limits<int>::max());
  const NeighborIndex index(points, whole.progress(), 500);
  EXPECT_EQ(whole.asks, 3);
  for (const int questions : {0, 2})
    EXPECT_THROW(NeighborIndex(points, Patience(questions).progress(), 500), Cancelled);
}

} // namespace
} // namespace surflect
