#include "render/lightfield/slf/border_gaps.h"

#include "render/lightfield/slf/plane_border.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace surflect::slf {
namespace {

using Polygon = std::vector<Vec2<double>>;

Polygon randomStar(std::mt19937& random, size_t corners) {
  std::uniform_real_distribution<double> radius(0.5, 1);
  Polygon star;
  for (size_t i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(corners);
    star.push_back(radius(random) * Vec2<double>(std::cos(angle), std::sin(angle)));
  }
  return star;
}

// A block of 10 x 10 with a notch of width 2 from the top; vertex 3 is the notch's upper right corner.
MovingBorder notched(double depth) {
  return MovingBorder(
      {{0, 0}, {10, 0}, {10, 10}, {6, 10}, {6, 10 - depth}, {4, 10 - depth}, {4, 10}, {0, 10}});
}

TEST(MovingBorder, ADeepGapKeepsTheClearance) {
  const MovingBorder border = notched(8);
  EXPECT_FALSE(border.wouldNarrowGap(3, {5.01, 10}, 1));
  EXPECT_TRUE(border.wouldNarrowGap(3, {4.99, 10}, 1));
}

TEST(MovingBorder, AShallowGapMayBeAsNarrowAsTheBorderAroundItIsShort) {
  // From (4 + d, 10) around the notch's bottom to (4, 10).
  const auto isTooNarrow = [](double d) { return d < 0.5 * (std::hypot(d - 2, 1) + 2 + 1 - 0.9); };
  const MovingBorder border = notched(1);
  for (const double d : {1.9, 1.7, 1.6, 1.59, 1.57, 1.5, 1.0})
    EXPECT_EQ(border.wouldNarrowGap(3, {4 + d, 10}, 1.8), isTooNarrow(d)) << d;
  EXPECT_TRUE(isTooNarrow(1.5) && !isTooNarrow(1.6));
}

TEST(MovingBorder, GapsThatAreTooNarrowMayWiden) {
  const MovingBorder border = notched(8);
  EXPECT_TRUE(border.wouldNarrowGap(3, {5.9, 10}, 3));
  EXPECT_FALSE(border.wouldNarrowGap(3, {6.1, 10}, 3));
}

TEST(MovingBorder, PartsOfTheInsideMayBeNarrow) {
  const MovingBorder bar({{0, 0}, {10, 0}, {10, 1}, {0, 1}});
  EXPECT_FALSE(bar.wouldNarrowGap(2, {10, 0.01}, 5));
}

TEST(MovingBorder, CrossingIsFoundAsInTheWholePolygon) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  size_t crossings = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    Polygon polygon = randomStar(random, 9);
    const MovingBorder border(polygon);
    const size_t vertex = random() % polygon.size();
    const Vec2<double> to(number(random), number(random));
    polygon[vertex] = to;
    EXPECT_EQ(border.wouldCross(vertex, to, 0), crossesItself(polygon));
    crossings += crossesItself(polygon);
  }
  EXPECT_GT(crossings, 200u);
  EXPECT_LT(crossings, 800u);
}

TEST(MovingBorder, AMovedBorderAnswersAsANewOne) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> number(-1, 1);
  MovingBorder moved(randomStar(random, 12));
  size_t narrow = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Polygon star = randomStar(random, 12);
    for (size_t vertex = 0; vertex < star.size(); ++vertex) moved.move(vertex, star[vertex]);
    const MovingBorder fresh(star);
    const Vec2<double> to(number(random), number(random));
    EXPECT_EQ(moved.wouldNarrowGap(3, to, 0.2), fresh.wouldNarrowGap(3, to, 0.2));
    narrow += fresh.wouldNarrowGap(3, to, 0.2);
  }
  EXPECT_GT(narrow, 30u);
  EXPECT_LT(narrow, 270u);
}

} // namespace
} // namespace surflect::slf
