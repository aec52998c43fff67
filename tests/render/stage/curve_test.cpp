#include "render/stage/curve.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace surflect::stage {
namespace {

using Vector = Vec3<double>;
constexpr double kPi = std::numbers::pi;

std::vector<CurvePoint> randomPoints(std::mt19937& random, size_t count) {
  std::uniform_real_distribution<double> coordinate(-1, 1), radius(0.1, 0.3);
  std::vector<CurvePoint> points;
  for (size_t i = 0; i < count; ++i) {
    const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
    points.push_back({Vector(x, y, z + 2. * static_cast<double>(i)), radius(random)});
  }
  return points;
}

std::vector<CurvePoint> circle(size_t count, bool repeatsFirst) {
  std::vector<CurvePoint> points;
  for (size_t i = 0; i < count; ++i) {
    const double phi = 2 * kPi * static_cast<double>(i) / static_cast<double>(count);
    points.push_back({Vector(std::cos(phi), 0, std::sin(phi)), 0.1});
  }
  if (repeatsFirst) points.push_back(points.front());
  return points;
}

TEST(SmoothCurve, GoesThroughItsPoints) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const auto points = randomPoints(random, 5);
    const SmoothCurve curve(points, trial % 2 == 1);
    EXPECT_EQ(curve.at(0).position, points.front().position);
    EXPECT_EQ(curve.at(1).position, points[trial % 2 == 1 ? 0 : 4].position);
    for (const CurvePoint& p : points) {
      double nearest = 1;
      for (int i = 0; i <= 2000; ++i)
        nearest = std::min(nearest, (curve.at(i / 2000.).position - p.position).norm());
      EXPECT_LT(nearest, 0.01);
    }
  }
}

TEST(SmoothCurve, IsALineThroughPointsOnALine) {
  const SmoothCurve curve({{Vector(0, 0, 0), 1}, {Vector(1, 2, 2), 2}, {Vector(4, 8, 8), 5}}, false);
  EXPECT_NEAR(curve.length(), 12, 1e-9);
  for (int i = 0; i <= 10; ++i) {
    const CurvePoint p = curve.at(i / 10.);
    EXPECT_LT((p.position - Vector(4, 8, 8) * i / 10.).norm(), 1e-9);
    EXPECT_NEAR(p.radius, 1 + 4 * i / 10., 1e-9);
    EXPECT_LT((curve.direction(i / 10.) - Vector(1, 2, 2) / 3).norm(), 1e-9);
  }
}

TEST(SmoothCurve, ConvergesToTheCircleOfItsPoints) {
  const auto error = [](size_t count) {
    return std::abs(SmoothCurve(circle(count, false), true).length() - 2 * kPi);
  };
  EXPECT_LT(error(32), 1e-2);
  EXPECT_GT(error(8) / error(32), 12); // second order, before the error of chords
}

TEST(SmoothCurve, TurnsWithoutCorners) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 10; ++trial) {
    const SmoothCurve curve(randomPoints(random, 6), trial % 2 == 1);
    for (int i = 0; i < 20'000; ++i)
      EXPECT_GT(curve.direction(i / 20'000.).dot(curve.direction((i + 1) / 20'000.)), 0.99);
    EXPECT_GT(trial % 2 == 1 ? curve.direction(0).dot(curve.direction(1)) : 1, 1 - 1e-9);
  }
}

TEST(SmoothCurve, AdvancesEvenly) {
  std::mt19937 random(5);
  const SmoothCurve curve(randomPoints(random, 6), false);
  for (int i = 0; i < 100; ++i)
    EXPECT_NEAR((curve.at((i + 1) / 1000.).position - curve.at(i / 1000.).position).norm(),
                curve.length() / 1000, 1e-3 * curve.length() / 10);
}

TEST(SmoothCurve, RefusesPointsThatMakeNone) {
  EXPECT_THROW(SmoothCurve({{Vector(0, 0, 0)}}, false), Error);
  EXPECT_THROW(SmoothCurve({{Vector(0, 0, 0)}, {Vector(1, 0, 0)}}, true), Error);
  EXPECT_THROW(SmoothCurve({{Vector(0, 0, 0)}, {Vector(0, 0, 0)}}, false), Error);
  EXPECT_THROW(SmoothCurve({{Vector(0, 0, 0)}, {Vector(1, 0, 0)}, {Vector(0, 0, 0)}}, true), Error);
}

TEST(CurveFrames, AreRightHandedAndDoNotTurnOnAPlanarCurve) {
  std::vector<CurvePoint> arc = circle(64, false);
  arc.resize(40);
  for (const CurveFrame& frame : framesAlong(arc, false)) {
    EXPECT_LT((frame.normal.cross(frame.binormal) - frame.tangent).norm(), 1e-12);
    EXPECT_NEAR(frame.tangent.norm(), 1, 1e-12);
    // The curve's plane stays where it is in the frame.
    EXPECT_NEAR(std::abs(frame.binormal.y()), 1, 1e-9);
  }
}

TEST(CurveFrames, CloseAndSpreadWhatIsLeft) {
  std::vector<CurvePoint> knot; // out of the plane, so that frames come back turned
  for (int i = 0; i <= 200; ++i) {
    const double phi = 2 * kPi * (i % 200) / 200;
    knot.push_back(
        {Vector(std::cos(phi), std::sin(phi), 0.5 * std::sin(2 * phi) + 0.3 * std::cos(phi)), 0.1});
  }
  const auto frames = framesAlong(knot, true);
  EXPECT_EQ(frames.front().normal, frames.back().normal);
  EXPECT_EQ(frames.front().tangent, frames.back().tangent);
  for (size_t i = 0; i + 1 < frames.size(); ++i) EXPECT_GT(frames[i].normal.dot(frames[i + 1].normal), 0.99);
}

} // namespace
} // namespace surflect::stage
