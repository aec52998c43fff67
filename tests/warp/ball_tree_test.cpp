#include "warp/ball_tree.h"

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
} // namespace surflect::warp
