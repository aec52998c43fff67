#include "warp/warp.h"

#include "tests/warp/random_warps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace surflect::warp {
namespace {

const Mat3<double> identity = Mat3<double>::Identity();

// Halving the step must quarter the distance to the exact Jacobian, down to rounding.
TEST(Jacobian, CentralDifferencesConvergeToItWithOrderTwo) {
  std::mt19937 random(1);
  for (const auto& [name, make] : exactWarps)
    for (int i = 0; i < 100; ++i) {
      const WarpPointer warp = make(random);
      const Vec3<double> x = randomVector(random);
      const Mat3<double> exact = *warp->jacobian(x);
      const auto distance = [&](double epsilon) {
        return (centralDifferences(*warp, x, identity, epsilon) - exact).norm();
      };
      const double coarse = distance(1e-2), fine = distance(5e-3);
      EXPECT_LT(std::abs(fine - coarse / 4), 0.01 * coarse + 1e-12) << name;
      EXPECT_LT(distance(1e-5), 1.1e-6 * coarse + 2e-10) << name;
    }
}

TEST(Jacobian, CentralDifferencesAreAlongTheGivenDirections) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const WarpPointer warp = randomTwist(random);
    const Vec3<double> x = randomVector(random);
    Mat3<double> directions;
    for (int k = 0; k < 3; ++k) directions.col(k) = randomUnit(random);
    const Mat3<double> along = centralDifferences(*warp, x, directions, 1e-5);
    EXPECT_LT((along - *warp->jacobian(x) * directions).norm(), 3e-10);
  }
}

TEST(RigidWarp, ItsJacobianIsTheRotationAndDistancesStay) {
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> axis = randomUnit(random), a = randomVector(random), b = randomVector(random);
    const double angle = randomBetween(-6, 6, random);
    const WarpPointer warp = rigidWarp(axis, Angle::fromRadians(angle), a, randomVector(random));
    const Mat3<double> rotation = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    EXPECT_EQ(*warp->jacobian(b), rotation);
    EXPECT_LT((warp->position(b) - warp->position(a) - rotation * (b - a)).norm(), 1e-15);
  }
}

TEST(RigidWarp, TurnsRightHandedAboutTheCentreAndThenTranslates) {
  const WarpPointer warp = rigidWarp({0, 0, 1}, Angle::fromDegrees(90), {1, 0, 0}, {0, 0, 5});
  EXPECT_LT((warp->position({2, 0, 0}) - Vec3<double>(1, 1, 5)).norm(), 1e-15);
}

TEST(ScaleWarp, StretchesFromTheCentre) {
  const WarpPointer warp = scaleWarp({2, -1, 0.5}, {1, 1, 1});
  EXPECT_EQ(warp->position({2, 3, 5}), Vec3<double>(3, -1, 3));
  EXPECT_EQ(warp->position({1, 1, 1}), Vec3<double>(1, 1, 1));
}

TEST(TwistWarp, TurnsByItsAngleForEveryUnitOfHeight) {
  std::mt19937 random(4);
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> axis = randomUnit(random), center = randomVector(random), x = randomVector(random);
    const double k = randomBetween(-3, 3, random), height = axis.dot(x - center);
    const WarpPointer twist = twistWarp(axis, Angle::fromRadians(k), center);
    const WarpPointer turn = rigidWarp(axis, Angle::fromRadians(k * height), center, Vec3<double>::Zero());
    EXPECT_LT((twist->position(x) - turn->position(x)).norm(), 1e-15);
  }
}

TEST(TwistWarp, KeepsVolume) {
  std::mt19937 random(5);
  for (int i = 0; i < 100; ++i)
    EXPECT_NEAR(randomTwist(random)->jacobian(randomVector(random))->determinant(), 1, 2e-15);
}

// Images of the axis, of planes across it and of m = a x d, on a circle of radius rho = 1/k about c + rho d.
TEST(BendWarp, BendsTheAxisIntoACircle) {
  std::mt19937 random(6);
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> a = randomUnit(random), d = a.cross(randomUnit(random)).normalized(), m = a.cross(d);
    const Vec3<double> center = randomVector(random);
    const double k = randomBetween(0.1, 2, random), rho = 1 / k;
    const double h = randomBetween(-3, 3, random), w = randomBetween(-1, 1, random),
                 q = randomBetween(-1, 1, random);
    const WarpPointer warp = bendWarp(a, d, Angle::fromRadians(k), center);
    const WarpPointer turn = rigidWarp(m, Angle::fromRadians(k * h), center + rho * d, Vec3<double>::Zero());
    // The plane at height h is the plane through the centre, turned about the centre of curvature by k h.
    const Vec3<double> inPlane = center + w * d + q * m;
    EXPECT_LT((warp->position(inPlane + h * a) - turn->position(inPlane)).norm(), 3e-15);
  }
}

TEST(BendWarp, BecomesTheIdentityAsItsAngleVanishes) {
  std::mt19937 random(7);
  for (const double k : {0., 1e-18, -1e-9, 1e-6, 1e-3}) {
    const Vec3<double> a = randomUnit(random), d = a.cross(randomUnit(random)).normalized(),
                       x = randomVector(random);
    const WarpPointer warp = bendWarp(a, d, Angle::fromRadians(k), Vec3<double>::Zero());
    EXPECT_LT((warp->position(x) - x).norm(), 2 * std::abs(k) + 1e-15);
    EXPECT_LT((*warp->jacobian(x) - identity).norm(), 4 * std::abs(k) + 1e-15);
  }
}

TEST(BendWarp, TurnsInsideOutBeyondTheCentreOfCurvature) {
  const WarpPointer warp = bendWarp({0, 1, 0}, {1, 0, 0}, Angle::fromRadians(2), {0, 0, 0});
  EXPECT_GT(warp->jacobian({0.49, 1, 0})->determinant(), 0);
  EXPECT_LT(warp->jacobian({0.51, 1, 0})->determinant(), 0);
}

TEST(TaperWarp, ScalesEachPlaneAcrossTheAxisByAPowerOfItsHeight) {
  std::mt19937 random(11);
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> axis = randomUnit(random), center = randomVector(random);
    const double growth = randomBetween(-2, 2, random), height = randomBetween(-2, 2, random);
    const WarpPointer warp = taperWarp(axis, growth, center);
    const Vec3<double> foot = center + height * axis, across = axis.cross(randomVector(random));
    const double scale = std::exp(growth * height), rounding = 1e-15 * (1 + scale);
    EXPECT_LT((warp->position(foot) - foot).norm(), rounding);
    EXPECT_LT((warp->position(foot + across) - foot - scale * across).norm(), 2 * rounding);
    EXPECT_GT(warp->jacobian(foot + across)->determinant(), 0);
  }
}

TEST(SineWarp, IsPeriodicAndStaysWithinItsAmplitude) {
  std::mt19937 random(8);
  for (int i = 0; i < 100; ++i) {
    SineWave wave{
        .axis = randomUnit(random), .direction = randomUnit(random), .center = randomVector(random)};
    wave.amplitude = 0.3;
    wave.wavelength = randomBetween(0.5, 2, random);
    const WarpPointer warp = sineWarp(wave);
    const Vec3<double> x = randomVector(random), next = x + wave.wavelength * wave.axis;
    EXPECT_LT((warp->position(next) - next - (warp->position(x) - x)).norm(), 3e-15);
    EXPECT_LE((warp->position(x) - x).norm(), 0.3 + 1e-15);
    const Vec3<double> crest = wave.center + wave.wavelength / 4 * wave.axis;
    EXPECT_LT((warp->position(crest) - crest - 0.3 * wave.direction).norm(), 3e-16);
  }
}

TEST(ChainWarp, WithoutLinksIsTheIdentity) {
  const WarpPointer none = chainWarp({});
  EXPECT_EQ(none->position({1, 2, 3}), Vec3<double>(1, 2, 3));
  EXPECT_EQ(*none->jacobian({1, 2, 3}), identity);
}

TEST(ChainWarp, AWarpAndItsInverseAreTheIdentity) {
  std::mt19937 random(9);
  const Vec3<double> zero = Vec3<double>::Zero();
  for (int i = 0; i < 100; ++i) {
    const Vec3<double> axis = randomUnit(random), center = randomVector(random), x = randomVector(random);
    const double angle = randomBetween(-3, 3, random);
    const auto signedAngle = [&](double sign) { return Angle::fromRadians(sign * angle); };
    SineWave there{.axis = axis, .direction = axis.cross(randomUnit(random)).normalized(), .center = center};
    there.amplitude = 0.2;
    SineWave back = there;
    back.amplitude = -0.2; // undoes it, as the phase does not change along the direction

    std::vector<WarpPointer> chains;
    chains.push_back(chainOf(rigidWarp(axis, signedAngle(1), center, zero),
                             rigidWarp(axis, signedAngle(-1), center, zero)));
    chains.push_back(chainOf(scaleWarp({2, -4, 0.5}, center), scaleWarp({0.5, -0.25, 2}, center)));
    chains.push_back(
        chainOf(twistWarp(axis, signedAngle(1), center), twistWarp(axis, signedAngle(-1), center)));
    chains.push_back(chainOf(sineWarp(there), sineWarp(back)));
    for (const WarpPointer& chain : chains) {
      EXPECT_LT((chain->position(x) - x).norm(), 7e-15);
      EXPECT_LT((*chain->jacobian(x) - identity).norm(), 9e-15);
    }
  }
}

TEST(ChainWarp, TheFirstLinkActsFirst) {
  const WarpPointer warp =
      chainOf(scaleWarp({2, 2, 2}, {0, 0, 0}), rigidWarp({0, 1, 0}, Angle(), {0, 0, 0}, {1, 0, 0}));
  EXPECT_EQ(warp->position({1, 0, 0}), Vec3<double>(3, 0, 0));
}

TEST(ExpressionWarp, TheFormulaOfATwistIsTheTwist) {
  std::mt19937 random(10);
  const double k = 1.3;
  const WarpPointer twist = twistWarp({0, 1, 0}, Angle::fromRadians(k), {0, 0, 0});
  const WarpPointer formula = formulas("x*cos(1.3*y) + z*sin(1.3*y)", "y", "z*cos(1.3*y) - x*sin(1.3*y)");
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> x = randomVector(random);
    EXPECT_LT((formula->position(x) - twist->position(x)).norm(), 1e-15);
    EXPECT_LT((centralDifferences(*formula, x, identity, 1e-5) - *twist->jacobian(x)).norm(), 1.3e-10);
  }
}

TEST(ExpressionWarp, KnowsTheShotTimeAndHasNoExactJacobian) {
  const WarpPointer warp = formulas("x + t", "y + frame", "z + s", {1, 20, 0.3});
  EXPECT_EQ(warp->position({0, 0, 0}), Vec3<double>(1, 20, 0.3));
  EXPECT_FALSE(warp->jacobian({0, 0, 0}));
  EXPECT_FALSE(chainOf(rigidWarp({0, 1, 0}, Angle(), {0, 0, 0}, {1, 0, 0}), formulas("x", "y", "z"))
                   ->jacobian({0, 0, 0}));
}

} // namespace
} // namespace surflect::warp
