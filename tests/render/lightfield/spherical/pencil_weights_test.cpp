#include "render/lightfield/spherical/pencil_weights.h"

#include "tests/support/random.h"

#include <map>
#include <random>

namespace surflect::spherical {
namespace {

std::map<uint32_t, double> weightsOf(const DirectionTree& tree, const Vec3<double>& direction) {
  std::map<uint32_t, double> weights;
  for (const PencilShare& share : pencilShares(tree, 3, direction, true))
    weights[share.pencil.index] += share.weight;
  return weights;
}

TEST(PencilWeights, SumToOneAndAreNeverNegative) {
  const DirectionTree tree(4);
  std::mt19937 random(4);
  for (int i = 0; i < 1000; ++i) {
    double sum = 0;
    for (const auto& [pencil, weight] : weightsOf(tree, randomUnit(random))) {
      EXPECT_GE(weight, -1e-12);
      sum += weight;
    }
    EXPECT_NEAR(sum, 1, 1e-12);
  }
}

TEST(PencilWeights, AreOneAtThePencilsOwnMiddle) {
  const DirectionTree tree(4);
  for (uint32_t i = 0; i < pencilsOf(3); i += 7)
    EXPECT_NEAR(weightsOf(tree, tree.middle({3, i})).at(i), 1, 1e-9);
}

TEST(PencilWeights, ChangeContinuouslyWithTheDirection) {
  const DirectionTree tree(4);
  std::mt19937 random(5);
  for (int path = 0; path < 20; ++path) {
    const Vec3<double> from = randomUnit(random), to = randomUnit(random);
    constexpr int kSteps = 4000;
    auto before = weightsOf(tree, from);
    for (int i = 1; i <= kSteps; ++i) {
      const auto now = weightsOf(tree, (from + (to - from) * (1.0 * i / kSteps)).normalized());
      for (const auto& [pencil, weight] : now) EXPECT_NEAR(weight, before[pencil], 0.15);
      before = now;
    }
  }
}

TEST(PencilWeights, TrianglesOfAPencilHaveTheSameWeightsAsItsDirections) {
  const DirectionTree tree(4);
  std::mt19937 random(6);
  for (int i = 0; i < 200; ++i) {
    const Vec3<double> direction = randomUnit(random);
    std::vector<WeightedTriangle> triangles;
    appendTriangles(tree, tree.find(3, direction), 0.5, true, triangles);
    EXPECT_GE(triangles.size(), 30u);
    std::map<uint32_t, double> drawn;
    for (const WeightedTriangle& triangle : triangles) {
      Mat3<double> corners;
      corners << triangle.corners[0], triangle.corners[1], triangle.corners[2];
      const Vec3<double> x = corners.inverse() * direction;
      if (x.minCoeff() < 0) continue;
      for (int k = 0; k < 3; ++k)
        drawn[triangle.pencil.index] += triangle.weights[static_cast<size_t>(k)] * x[k] / x.sum();
    }
    for (const auto& [pencil, weight] : weightsOf(tree, direction))
      EXPECT_NEAR(drawn[pencil], 0.5 * weight, 1e-9);
  }
}

TEST(PencilWeights, AFractionalLevelBlendsPencilsWithTheirChildren) {
  const auto shares = levelShares(2 + 1.0 / 3, 4);
  ASSERT_EQ(shares.size(), 2u);
  EXPECT_EQ(shares[0].level, 2u);
  EXPECT_NEAR(shares[0].weight, 2.0 / 3, 1e-12);
  EXPECT_EQ(shares[1].level, 3u);
  EXPECT_NEAR(shares[1].weight, 1.0 / 3, 1e-12);
  EXPECT_EQ(levelShares(2, 4).size(), 1u);
  EXPECT_EQ(levelShares(9, 4)[0].level, 3u);
}

} // namespace
} // namespace surflect::spherical
