#include "srf/reflectance/table_coordinates.h"

#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>

namespace surflect::reflectance {
namespace {

using Local = Direction3<SurfelSpace, double>;

double distance(const HalfDifference<double>& a, const HalfDifference<double>& b) {
  return std::max({std::abs(a.halfU - b.halfU), std::abs(a.halfV - b.halfV),
                   std::abs(a.differenceU - b.differenceU), std::abs(a.differenceV - b.differenceV)});
}

Local turnedBack(const Local& d, double angle) {
  return {d.x() * std::cos(angle) + d.y() * std::sin(angle),
          d.y() * std::cos(angle) - d.x() * std::sin(angle), d.z()};
}

TEST(TableCoordinates, ExchangeOfLightAndViewerGivesTheSameBits) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto v = planted::above(random, -1), l = planted::above(random, -1);
    EXPECT_EQ(halfDifference(v, l), halfDifference(l, v));
  }
}

// Reference by angles and rotations, where the header projects.
TEST(TableCoordinates, AreThoseOfHalfAndDifferenceAngles) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto v = planted::above<double>(random), l = planted::above<double>(random);
    const Vec3<double> h = (v.raw() + l.raw()).normalized();
    const double toHalf = std::acos(h.z()), azimuth = std::atan2(h.y(), h.x());
    const Eigen::AngleAxisd upright(-toHalf, Vec3<double>(-std::sin(azimuth), std::cos(azimuth), 0));
    const Vec3<double> difference = upright * l.raw();
    const double phi = std::atan2(difference.y(), difference.x()), theta = std::acos(difference.z());
    const auto at = halfDifference(v, l);
    EXPECT_NEAR(at.halfU, std::tan(toHalf / 2) * std::cos(azimuth), 1e-14);
    EXPECT_NEAR(at.halfV, std::tan(toHalf / 2) * std::sin(azimuth), 1e-14);
    EXPECT_NEAR(at.differenceU, std::sin(theta) * std::cos(2 * phi), 1e-14);
    EXPECT_NEAR(at.differenceV, std::sin(theta) * std::sin(2 * phi), 1e-14);
  }
}

TEST(TableCoordinates, SinglePrecisionIsThatOfDoublePrecision) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto v = planted::above(random, 0), l = planted::above(random, 0);
    const auto single = halfDifference(v, l);
    const auto exact = halfDifference(v.cast<double>(), l.cast<double>());
    EXPECT_LT(distance({single.halfU, single.halfV, single.differenceU, single.differenceV}, exact), 3e-7);
  }
}

TEST(TableCoordinates, HalfTurnAboutTheNormalTurnsTheHalfVectorAlone) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto v = planted::above(random, 0), l = planted::above(random, 0);
    const auto at = halfDifference(v, l);
    const auto turnedAt = halfDifference<float>({-v.x(), -v.y(), v.z()}, {-l.x(), -l.y(), l.z()});
    EXPECT_EQ(turnedAt, (HalfDifference<>{-at.halfU, -at.halfV, at.differenceU, at.differenceV}));
  }
}

TEST(TableCoordinates, ATurnedFrameHasTurnedCoordinates) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angles(-4, 4);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto v = planted::above<double>(random, 0), l = planted::above<double>(random, 0);
    const double angle = angles(random);
    EXPECT_LT(distance(turned(halfDifference(v, l), Angle::fromRadians(angle)),
                       halfDifference(turnedBack(v, angle), turnedBack(l, angle))),
              2e-15);
    EXPECT_LT(distance(withoutAngles(halfDifference(v, l)),
                       withoutAngles(halfDifference(turnedBack(v, angle), turnedBack(l, angle)))),
              2e-15);
  }
}

TEST(TableCoordinates, AreWithinTheUnitDiscs) {
  std::mt19937 random(6);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto at = halfDifference(planted::above<double>(random, 0), planted::above<double>(random, 0));
    EXPECT_LE(std::hypot(at.halfU, at.halfV), 1 + 1e-12);
    EXPECT_LE(std::hypot(at.differenceU, at.differenceV), 1 + 1e-12);
  }
}

// Greatest change of a coordinate in one of 4001 steps, while view and light each go from one direction to
// another.
double greatestJump(const Vec3<double>& v0, const Vec3<double>& v1, const Vec3<double>& l0,
                    const Vec3<double>& l1) {
  constexpr int kSteps = 4001;
  double jump = 0;
  HalfDifference<double> before;
  for (int step = 0; step <= kSteps; ++step) {
    const double t = static_cast<double>(step) / kSteps;
    const auto at = halfDifference(assume<Local>(((1 - t) * v0 + t * v1).normalized()),
                                   assume<Local>(((1 - t) * l0 + t * l1).normalized()));
    if (step > 0) jump = std::max(jump, distance(at, before));
    before = at;
  }
  return jump;
}

// Coordinates may change by 1 / kOppositeSum times as much as directions do.
TEST(TableCoordinates, AreContinuousAlongPaths) {
  constexpr double kMost = 0.012;
  std::mt19937 random(7);
  const auto any = [&random] { return Vec3<double>(planted::above<double>(random, 0.02).raw()); };
  for (int trial = 0; trial < 30; ++trial) {
    EXPECT_LT(greatestJump(any(), any(), any(), any()), kMost);
    const Vec3<double> v = any(), w = any();
    EXPECT_LT(greatestJump(v, w, v, any()), kMost) << "from light and viewer in one direction";
    EXPECT_LT(greatestJump(v, w, w, v), kMost) << "through light and viewer in one direction";
  }
}

TEST(TableCoordinates, AreContinuousAtTheHorizonAndWhereLightAndViewerAreOpposite) {
  constexpr double kMost = 0.01;
  EXPECT_LT(greatestJump({1, 0, 0.3}, {1, 0.1, -0.3}, {0.2, 1, 0.2}, {0.2, 1, -0.3}), kMost);
  EXPECT_LT(greatestJump({1, 0, 0}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}), kMost);
  EXPECT_LT(greatestJump({1, 0, 0.01}, {1, 0, 0.01}, {-1, 1, 0.01}, {-1, -1, 0.01}), kMost);
  EXPECT_LT(greatestJump({1, 0, 0.1}, {1, 0, -0.1}, {-1, 0, 0.1}, {-1, 0, -0.1}), kMost);
}

TEST(TableLink, TimesTheCosineRatioIsSymmetric) {
  // X = k T and f = X / c_l: f sqrt(c_l c_v) = T whichever direction is the light's.
  for (const double light : {0.1, 0.4, 1.0})
    for (const double view : {0.1, 0.7, 1.0})
      EXPECT_NEAR(tableLink(light, view) / light, tableLink(view, light) / view, 1e-12);
  EXPECT_EQ(tableLink(-0.2, 0.5), 0);
}

} // namespace
} // namespace surflect::reflectance
