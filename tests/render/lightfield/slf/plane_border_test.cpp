#include "render/lightfield/slf/plane_border.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace surflect::slf {
namespace {

using Polygon = std::vector<Vec2<double>>;

TEST(PlaneBorder, AreaIsPositiveCounterClockwise) {
  EXPECT_EQ(planeArea({0, 0}, {2, 0}, {0, 1}), 1);
  EXPECT_EQ(planeArea({0, 0}, {0, 1}, {2, 0}), -1);
}

TEST(PlaneBorder, SegmentsMeetWhereTheyCrossOrTouch) {
  EXPECT_TRUE(segmentsMeet({0, 0}, {2, 2}, {0, 2}, {2, 0}));
  EXPECT_TRUE(segmentsMeet({0, 0}, {2, 0}, {1, 0}, {1, 5}));
  EXPECT_TRUE(segmentsMeet({0, 0}, {2, 0}, {1, 0}, {3, 0}));
  EXPECT_FALSE(segmentsMeet({0, 0}, {2, 0}, {1, 1e-9}, {1, 5}));
  EXPECT_FALSE(segmentsMeet({0, 0}, {2, 0}, {2.5, 0}, {3, 0}));
  EXPECT_FALSE(segmentsMeet({0, 0}, {4, 4}, {3, 0}, {2.1, 2}));
}

TEST(PlaneBorder, SegmentsWithinTheMarginMeet) {
  EXPECT_TRUE(segmentsMeet({0, 0}, {2, 0}, {1, 0.1}, {1, 5}, 0.11));
  EXPECT_FALSE(segmentsMeet({0, 0}, {2, 0}, {1, 0.1}, {1, 5}, 0.09));
  EXPECT_TRUE(segmentsMeet({0, 0}, {2, 0}, {2.3, 0.4}, {9, 5}, 0.51));
  EXPECT_FALSE(segmentsMeet({0, 0}, {2, 0}, {2.3, 0.4}, {9, 5}, 0.49));
}

TEST(PlaneBorder, StarsDoNotCrossThemselvesAndPentagramsDo) {
  Polygon star, pentagram;
  for (size_t i = 0; i < 5; ++i) {
    const auto at = [](double fifths, double radius) -> Vec2<double> {
      const double angle = 2 * std::numbers::pi * fifths / 5;
      return {radius * std::cos(angle), radius * std::sin(angle)};
    };
    const auto fifth = static_cast<double>(i);
    star.push_back(at(fifth, 1)), star.push_back(at(fifth + 0.5, 0.2));
    pentagram.push_back(at(2 * fifth, 1));
  }
  EXPECT_FALSE(crossesItself(star));
  EXPECT_TRUE(crossesItself(pentagram));
}

TEST(PlaneBorder, TrianglesNeverCrossThemselves) {
  EXPECT_FALSE(crossesItself(Polygon{{0, 0}, {1, 0}, {0, 1}}));
}

TEST(PlaneBorder, SweepFindsWhatAllPairsFind) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 1);
  int crossing = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    // Random radii around a point give no crossing; a swap often does.
    Polygon polygon;
    for (int i = 0; i < 8; ++i) {
      const double angle = 2 * std::numbers::pi * i / 8, radius = 0.2 + number(random);
      polygon.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    if (trial % 2) std::swap(polygon[random() % 8], polygon[random() % 8]);
    bool expected = false;
    for (size_t e = 0; e < 8; ++e)
      for (size_t f = e + 2; f < 8; ++f)
        if ((f + 1) % 8 != e)
          expected |= segmentsMeet(polygon[e], polygon[e + 1], polygon[f], polygon[(f + 1) % 8]);
    EXPECT_EQ(crossesItself(polygon), expected);
    crossing += expected;
  }
  EXPECT_GT(crossing, 500);
  EXPECT_LT(crossing, 1500);
}

} // namespace
} // namespace surflect::slf
