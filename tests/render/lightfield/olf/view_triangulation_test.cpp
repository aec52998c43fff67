#include "render/lightfield/olf/view_triangulation.h"

#include "tests/render/lightfield/olf/continuity.h"
#include "tests/support/random.h"

#include <cmath>
#include <map>
#include <utility>
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

namespace {

const lfm::VertexFrame kFrame; // z up

std::vector<Vec3<double>> upperDirections(std::mt19937& random, size_t count, double lowest = 0.05) {
  std::vector<Vec3<double>> directions;
  while (directions.size() < count)
    if (const Vec3<double> d = randomUnit(random); d[2] > lowest) directions.push_back(d);
  return directions;
}

class InBothDomains : public ::testing::TestWithParam<Domain> {};
INSTANTIATE_TEST_SUITE_P(ViewTriangulation, InBothDomains, ::testing::Values(Domain::sphere, Domain::plane));

TEST_P(InBothDomains, AViewFromACameraIsThatCameras) {
  std::mt19937 random(2);
  const std::vector<Vec3<double>> views = upperDirections(random, 60);
  const ViewTriangulation triangulation(views, kFrame, GetParam());
  EXPECT_GT(triangulation.triangles(), 80u);
  for (uint32_t i = 0; i < views.size(); ++i) {
    const auto weights = weightsOf(triangulation.at(views[i]));
    EXPECT_NEAR(weights.at(i), 1, 1e-9);
  }
}

TEST_P(InBothDomains, WeightsAreNotNegativeAndSumToOneEverywhere) {
  std::mt19937 random(3);
  for (size_t count = 1; count < 40; ++count) {
    const ViewTriangulation triangulation(upperDirections(random, count), kFrame, GetParam());
    for (int trial = 0; trial < 50; ++trial) {
      const ClosestViews closest = triangulation.at(randomUnit(random));
      double sum = 0;
      for (const auto& [view, weight] : closest) {
        EXPECT_GE(weight, 0);
        EXPECT_LT(view, count);
        sum += weight;
      }
      EXPECT_NEAR(sum, 1, 1e-12);
    }
  }
}

// No jump along 1,000 paths, and halving the step nearly halves the largest change. On the plane, one path
// crosses a triangle at the border that is as thin as 2e-6 of the path.
TEST_P(InBothDomains, WeightsAreContinuousAlongPaths) {
  std::mt19937 random(4);
  int halved = 0;
  for (int path = 0; path < 1000; ++path) {
    const ViewTriangulation triangulation(upperDirections(random, 12), kFrame, GetParam());
    const Vec3<double> from = upperDirections(random, 1)[0], to = upperDirections(random, 1)[0];
    const PathChange change = changeAlong(
        [&](double share) { return triangulation.at(((1 - share) * from + share * to).normalized()); }, 300);
    EXPECT_LE(change.last, 1e-5) << "path " << path;
    halved += change.halves;
  }
  EXPECT_GE(halved, GetParam() == Domain::sphere ? 1000 : 999);
}

TEST_P(InBothDomains, ThreeViewsBlendByBarycentricWeights) {
  const std::vector<Vec3<double>> views{Vec3<double>(1, 0, 2).normalized(),
                                        Vec3<double>(-1, 1, 2).normalized(),
                                        Vec3<double>(-1, -1, 2).normalized()};
  const ViewTriangulation triangulation(views, kFrame, GetParam());
  const Vec3<double> d = Vec3<double>(0.1, 0.05, 1).normalized();
  Vec3<double> sum = Vec3<double>::Zero();
  for (const auto& [view, weight] : triangulation.at(d)) sum += weight * views[view];
  if (GetParam() == Domain::sphere)
    EXPECT_LE((sum.normalized() - d).norm(), 1e-12);
  else
    EXPECT_LE((sum - d).head<2>().norm(), 1e-12);
}

TEST_P(InBothDomains, OutsideTheTwoViewsOfTheNearestEdgeBlend) {
  const std::vector<Vec3<double>> views{Vec3<double>(1, 1, 3).normalized(),
                                        Vec3<double>(1, -1, 3).normalized(),
                                        Vec3<double>(-1, 0, 3).normalized()};
  const ViewTriangulation triangulation(views, kFrame, GetParam());
  const auto weights = weightsOf(triangulation.at(Vec3<double>(5, 0, 1).normalized()));
  ASSERT_EQ(weights.size(), 2u);
  EXPECT_NEAR(weights.at(0), 0.5, 1e-9);
  EXPECT_NEAR(weights.at(1), 0.5, 1e-9);
  EXPECT_GT(weightsOf(triangulation.at(Vec3<double>(5, 1, 1).normalized())).at(0), 0.55);
}

TEST_P(InBothDomains, FewerThanThreeViewsAreWeightedByTheirDistance) {
  const std::vector<Vec3<double>> views{Vec3<double>(1, 0, 1).normalized(),
                                        Vec3<double>(-1, 0, 1).normalized()};
  EXPECT_EQ(ViewTriangulation({}, kFrame, GetParam()).at(views[0]).size(), 0u);
  const auto alone = weightsOf(ViewTriangulation(std::span(views).first(1), kFrame, GetParam()).at(views[1]));
  EXPECT_EQ(alone.at(0), 1);
  const ViewTriangulation both(views, kFrame, GetParam());
  EXPECT_NEAR(weightsOf(both.at({0, 0, 1})).at(0), 0.5, 1e-12);
  EXPECT_NEAR(weightsOf(both.at(views[0])).at(0), 1, 1e-9);
  EXPECT_GT(weightsOf(both.at(Vec3<double>(0.3, 0, 1).normalized())).at(0), 0.55);
}

TEST_P(InBothDomains, ViewsInALineBlendTheTwoNextToTheDirection) {
  std::vector<Vec3<double>> views;
  for (const double angle : {-0.8, -0.3, 0.1, 0.6}) views.emplace_back(std::sin(angle), 0, std::cos(angle));
  const ViewTriangulation triangulation(views, kFrame, GetParam());
  EXPECT_EQ(triangulation.triangles(), 0u);
  const auto between =
      weightsOf(triangulation.at(Vec3<double>(std::sin(-0.1), 0.2, std::cos(-0.1)).normalized()));
  ASSERT_EQ(between.size(), 2u);
  EXPECT_TRUE(between.contains(1) && between.contains(2));
  EXPECT_EQ(weightsOf(triangulation.at(Vec3<double>(1, 0, 0.1).normalized())).at(3), 1);
}

// No view is nearer to the middle of a triangle's circle on the sphere than its corners.
TEST(ViewTriangulation, CirclesOnTheSphereAreEmpty) {
  std::mt19937 random(5);
  const std::vector<Vec3<double>> views = upperDirections(random, 50, 0.3);
  const ViewTriangulation triangulation(views, kFrame, Domain::sphere);
  size_t inside = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const auto weights = weightsOf(triangulation.at(upperDirections(random, 1, 0.5)[0]));
    if (weights.size() < 3) continue;
    ++inside;
    std::vector<Vec3<double>> corners;
    for (const auto& [view, weight] : weights) corners.push_back(views[view]);
    Vec3<double> axis = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    if (axis.dot(corners[0]) < 0) axis = -axis;
    for (const Vec3<double>& view : views) EXPECT_LE(axis.dot(view), axis.dot(corners[0]) + 1e-9);
  }
  EXPECT_GT(inside, 300u);
}

// A search from the start of any cell ends in the one triangle that holds the direction.
TEST_P(InBothDomains, TheSearchEndsInTheTriangleThatHoldsTheDirection) {
  std::mt19937 random(7);
  const std::vector<Vec3<double>> views = upperDirections(random, 400);
  const ViewTriangulation triangulation(views, kFrame, GetParam());
  size_t inside = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3<double> d = upperDirections(random, 1, 0.2)[0];
    Vec3<double> sum = Vec3<double>::Zero();
    const ClosestViews closest = triangulation.at(d);
    for (const auto& [view, weight] : closest)
      sum += weight *
             (GetParam() == Domain::plane ? Vec3<double>(views[view][0], views[view][1], 1) : views[view]);
    if (closest.size() < 3) continue;
    ++inside;
    const Vec3<double> aim = GetParam() == Domain::plane ? Vec3<double>(d[0], d[1], 1) : d;
    EXPECT_LE((sum.normalized() - aim.normalized()).norm(), 1e-12);
  }
  EXPECT_GT(inside, 1900u);
}

TEST(ViewTriangulation, AViewerAtTheVertexHasWeights) {
  std::mt19937 random(8);
  const ViewTriangulation triangulation(upperDirections(random, 30), kFrame, Domain::sphere);
  EXPECT_GT(triangulation.at({0, 0, 0}).size(), 0u); // as Eigen normalises the zero vector
}

TEST(ViewTriangulation, ViewsAllAroundNeedNoBorder) {
  std::mt19937 random(6);
  std::vector<Vec3<double>> views;
  for (int i = 0; i < 200; ++i) views.push_back(randomUnit(random));
  const ViewTriangulation triangulation(views, kFrame, Domain::sphere);
  for (uint32_t i = 0; i < views.size(); ++i)
    EXPECT_NEAR(weightsOf(triangulation.at(views[i])).at(i), 1, 1e-9);
}

} // namespace

} // namespace surflect::olf
