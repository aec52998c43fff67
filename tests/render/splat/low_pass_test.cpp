#include "render/splat/low_pass.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace surflect::splat {
namespace {

using Eigen::Matrix2d;

constexpr double kH = 0.44;

// Covariance of an ellipse with these standard deviations, turned by an angle.
Matrix2d ellipse(double a, double b, double angle) {
  const Matrix2d turn = Eigen::Rotation2Dd(angle).toRotationMatrix();
  return turn * Eigen::Vector2d(a * a, b * b).asDiagonal() * turn.transpose();
}

TEST(LowPass, LeavesSplatsWiderThanItsWidthAlone) {
  EXPECT_LT(lowPassDeficit(ellipse(3, 0.45, 0.7), kH).norm(), 1e-12);
  const LowPassed wide = lowPassed(ellipse(3, 0.45, 0.7), {0.2, -0.1}, kH);
  EXPECT_NEAR(wide.energyKept, 1, 1e-12);
  EXPECT_NEAR(wide.orderDeviation, 0, 1e-12);
}

TEST(LowPass, WidensEachAxisToItsWidth) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> size(0.01, 2), angle(0, 3);
  for (int trial = 0; trial < 100; ++trial) {
    const double a = size(random), b = size(random), turn = angle(random);
    const Matrix2d wanted = ellipse(std::max(a, kH), std::max(b, kH), turn);
    EXPECT_LT((lowPassed(ellipse(a, b, turn), {0, 0}, kH).covariance - wanted).norm(), 1e-9);
  }
}

TEST(LowPass, KeepsTheEnergyOfASplat) {
  const Matrix2d V = ellipse(0.3, 0.02, 1.1);
  const LowPassed small = lowPassed(V, {0, 0}, kH);
  EXPECT_NEAR(small.energyKept * std::sqrt(small.covariance.determinant()), std::sqrt(V.determinant()),
              1e-12);
}

TEST(LowPass, OrdersOfOnePlaneDifferMoreTheSteeperItIs) {
  double before = 0;
  for (const double steepness : {0.1, 0.2, 0.4}) {
    const double now = lowPassed(ellipse(0.2, 0.1, 0.3), {steepness, 0}, kH).orderDeviation;
    EXPECT_GT(now, before);
    before = now;
  }
  EXPECT_TRUE(std::isfinite(lowPassed(ellipse(0.2, 0, 0.3), {0.1, 0.1}, kH).orderDeviation)); // edge-on
}

} // namespace
} // namespace surflect::splat
