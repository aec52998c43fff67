#include "surfel/math/bounds.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect {
namespace {

using ObjectPoint = Point3<ObjectSpace>;

TEST(Bounds, HoldAllPointsAndEachSideTouchesOne) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-3, 5);
  for (size_t count = 1; count < 20; ++count) {
    std::vector<ObjectPoint> points;
    for (size_t i = 0; i < count; ++i) {
      const float x = uniform(random), y = uniform(random), z = uniform(random);
      points.emplace_back(x, y, z);
    }
    const Eigen::AlignedBox3d box = boundsOf(points);
    Vec3<double> least = box.max(), most = box.min();
    for (const ObjectPoint& p : points) {
      EXPECT_TRUE(box.contains(p.cast<double>().raw()));
      least = least.cwiseMin(p.cast<double>().raw());
      most = most.cwiseMax(p.cast<double>().raw());
    }
    EXPECT_EQ(least, box.min());
    EXPECT_EQ(most, box.max());
    EXPECT_EQ(middleOf(points).raw(), (least + most) / 2);
  }
}

TEST(Bounds, OfNoPointsAreEmpty) { EXPECT_TRUE(boundsOf(std::vector<ObjectPoint>{}).isEmpty()); }

} // namespace
} // namespace surflect
