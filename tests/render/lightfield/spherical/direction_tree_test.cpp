#include "render/lightfield/spherical/direction_tree.h"

#include "tests/support/random.h"

#include <numbers>
#include <random>
#include <set>

namespace surflect::spherical {
namespace {

double areaOf(const Corners& corners) {
  const auto& [a, b, c] = corners;
  return 2 * std::atan2(a.dot(b.cross(c)), 1 + a.dot(b) + b.dot(c) + c.dot(a));
}

TEST(DirectionTree, PencilsOfALevelCoverTheSphereOnce) {
  const DirectionTree tree(4);
  for (uint32_t level = 0; level < 4; ++level) {
    double area = 0;
    for (uint32_t i = 0; i < pencilsOf(level); ++i) {
      const double one = areaOf(tree.corners({level, i}));
      EXPECT_GT(one, 0); // counter-clockwise
      area += one;
    }
    EXPECT_NEAR(area, 4 * std::numbers::pi, 1e-9);
  }
}

TEST(DirectionTree, ChildrenCoverTheirParent) {
  const DirectionTree tree(3);
  for (uint32_t i = 0; i < pencilsOf(1); ++i) {
    double area = 0;
    for (uint32_t child = 0; child < 4; ++child) {
      EXPECT_EQ(parentOf({2, 4 * i + child}), (Pencil{1, i}));
      area += areaOf(tree.corners({2, 4 * i + child}));
    }
    EXPECT_NEAR(area, areaOf(tree.corners({1, i})), 1e-12);
  }
}

TEST(DirectionTree, FindsThePencilThatHoldsADirection) {
  const DirectionTree tree(5);
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    const Vec3<double> direction = randomUnit(random);
    for (size_t level = 0; level < 5; ++level) {
      const Pencil found = tree.find(level, direction);
      const auto [a, b, c] = tree.corners(found);
      EXPECT_GT(a.cross(b).dot(direction), -1e-12);
      EXPECT_GT(b.cross(c).dot(direction), -1e-12);
      EXPECT_GT(c.cross(a).dot(direction), -1e-12);
    }
  }
}

TEST(DirectionTree, AllLevelsTogetherHaveAsManyImagesAsTheFinestHasPencils) {
  for (uint32_t level = 0; level < 5; ++level) {
    std::set<ImageNumber> images;
    for (uint32_t l = 0; l <= level; ++l)
      for (uint32_t i = 0; i < pencilsOf(l); ++i) images.insert(imageOf({l, i}));
    EXPECT_EQ(images.size(), pencilsOf(level));
    EXPECT_EQ(*images.rbegin(), images.size() - 1); // numbered without gaps
  }
  EXPECT_EQ(imagesUpTo(5), 20480u);
}

TEST(DirectionTree, ACentreChildInheritsItsParentsImage) {
  for (uint32_t i = 0; i < pencilsOf(2); ++i) {
    EXPECT_EQ(imageOf({3, 4 * i}), imageOf({2, i}));
    for (uint32_t child = 1; child < 4; ++child)
      EXPECT_EQ(pencilOf(imageOf({3, 4 * i + child})), (Pencil{3, 4 * i + child}));
  }
}

TEST(DirectionTree, FiveOrSixPencilsMeetAtEveryVertex) {
  const DirectionTree tree(3);
  size_t five = 0, vertices = 0;
  for (uint32_t v = 0; v < pencilsOf(2) / 2 + 2; ++v, ++vertices) {
    const size_t meeting = tree.around(2, v).size();
    EXPECT_TRUE(meeting == 5 || meeting == 6);
    five += meeting == 5;
  }
  EXPECT_EQ(five, 12u); // the icosahedron's own
}

} // namespace
} // namespace surflect::spherical
