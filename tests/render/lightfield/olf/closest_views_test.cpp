#include "render/lightfield/olf/closest_views.h"

#include "tests/render/lightfield/olf/continuity.h"
#include "tests/support/random.h"

#include <cmath>
#include <map>
#include <vector>

namespace surflect::olf {
namespace {

TEST(UlrViews, WeightsAreNotNegativeAndSumToOne) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> penalty(0, 2);
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<double> penalties(1 + static_cast<size_t>(trial % 9));
    for (double& p : penalties) p = penalty(random);
    const ClosestViews closest = ulrViews(penalties);
    double sum = 0;
    for (const auto& [view, weight] : closest) {
      EXPECT_GE(weight, 0);
      EXPECT_LT(view, penalties.size());
      sum += weight;
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_LE(closest.size(), 3u);
  }
}

TEST(UlrViews, AreThoseOfThePaper) {
  // Eq. 4 with cosines 0.9, 0.8, 0.6 and the threshold's 0.5.
  const std::map<uint32_t, double> weights = weightsOf(ulrViews(std::vector{0.4, 0.1, 0.2, 0.5, 0.9}));
  const double r1 = (0.9 - 0.5) / 0.1, r2 = (0.8 - 0.5) / 0.2, r3 = (0.6 - 0.5) / 0.4, sum = r1 + r2 + r3;
  EXPECT_NEAR(weights.at(1), r1 / sum, 1e-12);
  EXPECT_NEAR(weights.at(2), r2 / sum, 1e-12);
  EXPECT_NEAR(weights.at(0), r3 / sum, 1e-12);
}

TEST(UlrViews, OfThreeTheThirdIsTheThreshold) {
  const ClosestViews closest = ulrViews(std::vector{0.4, 0.1, 0.2});
  EXPECT_EQ(closest.size(), 2u);
  EXPECT_NEAR(weightsOf(closest).at(1), (0.3 / 0.1) / (0.3 / 0.1 + 0.2 / 0.2), 1e-12);
}

TEST(UlrViews, FewerThanThreeFadeAtARightAngle) {
  const std::map<uint32_t, double> weights = weightsOf(ulrViews(std::vector{0.5, 1.2}));
  EXPECT_EQ(weights.at(0), 1);
  EXPECT_FALSE(weights.contains(1));
  // Both beyond: the nearest.
  EXPECT_EQ(weightsOf(ulrViews(std::vector{1.5, 1.2})).at(1), 1);
  EXPECT_EQ(weightsOf(ulrViews(std::vector{1.9})).at(0), 1);
  EXPECT_EQ(ulrViews({}).size(), 0u);
}

TEST(UlrViews, AViewThatIsMetExactlyHasAllTheWeight) {
  EXPECT_NEAR(weightsOf(ulrViews(std::vector{0.3, 0.0, 0.2, 0.1})).at(1), 1, 1e-12);
}

TEST(UlrViews, EqualPenaltiesGiveTheNearest) {
  EXPECT_EQ(weightsOf(ulrViews(std::vector{0.0, 0.0, 0.0, 0.0})).at(0), 1);
  EXPECT_EQ(weightsOf(ulrViews(std::vector{0.2, 0.2, 0.2, 0.2})).at(0), 1);
}

TEST(UlrViews, AViewLeavesTheSetWithoutWeight) {
  for (const double beyond : {1e-3, 1e-6, 1e-9}) {
    const auto inside = weightsOf(ulrViews(std::vector{0.1, 0.2, 0.4 - beyond, 0.4}));
    const auto outside = weightsOf(ulrViews(std::vector{0.1, 0.2, 0.4 + beyond, 0.4}));
    EXPECT_LE(inside.at(2), 2 * beyond);
    EXPECT_FALSE(outside.contains(2));
    EXPECT_NEAR(inside.at(0), outside.at(0), 2 * beyond);
  }
}

} // namespace
} // namespace surflect::olf
