#include "surfel/look_up.h"

#include "tests/support/random.h"

#include <Eigen/QR>
#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace surflect {
namespace {

// The Jacobian of a warp that stretches by up to 1:8; half of them mirror.
Mat3<double> randomJacobian(std::mt19937& random) {
  std::uniform_real_distribution<double> exponent(-1.5, 1.5);
  const Vec3<double> stretch(std::exp2(exponent(random)), std::exp2(exponent(random)),
                             (random() & 1 ? 1 : -1) * std::exp2(exponent(random)));
  return randomRotation(random) * stretch.asDiagonal() * randomRotation(random);
}

// L at a surfel of frame r0, turned by an azimuth, under a warp of Jacobian j.
template <class T = double> LookUp<T> lookUpOf(const Mat3<double>& j, const Mat3<double>& r0) {
  const Mat3<double> warped = j * r0;
  const auto frame = polarFrame<T>(warped.col(0).cast<T>(), warped.col(1).cast<T>());
  return LookUp<T>(r0.cast<T>(), *frame, j.determinant() < 0 ? T(-1) : T(1));
}

Direction3<ObjectSpace, double> asDirection(const Vec3<double>& d) {
  return assume<Direction3<ObjectSpace, double>>(d);
}

TEST(LookUp, IsOrthogonalInFloat) {
  std::mt19937 random(1);
  for (int i = 0; i < 10000; ++i) {
    const Mat3<double> j = randomJacobian(random);
    const Mat3<float> l = lookUpOf<float>(j, randomRotation(random)).matrix();
    EXPECT_LT((l * l.transpose() - Mat3<float>::Identity()).cwiseAbs().maxCoeff(), 1e-6f);
    EXPECT_NEAR(l.determinant(), j.determinant() < 0 ? -1 : 1, 1e-6f);
  }
}

TEST(LookUp, IdentityWarpGivesTheIdentity) {
  std::mt19937 random(2);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> l = lookUpOf(Mat3<double>::Identity(), randomRotation(random)).matrix();
    EXPECT_LT((l - Mat3<double>::Identity()).norm(), 3e-15);
  }
}

TEST(LookUp, UniformScaleChangesNothing) {
  std::mt19937 random(3);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> j = randomJacobian(random), r0 = randomRotation(random);
    const double scale = std::exp2(i % 20 - 10);
    EXPECT_EQ(lookUpOf(j, r0).matrix(), lookUpOf(scale * j, r0).matrix()); // a power of 2: exactly
  }
}

TEST(LookUp, UnderARotationIsItsInverse) {
  std::mt19937 random(4);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> rotation = randomRotation(random);
    EXPECT_LT((lookUpOf(rotation, randomRotation(random)).matrix() - rotation.transpose()).norm(), 3e-15);
  }
}

TEST(LookUp, UnderAReflectionIsItsInverse) {
  std::mt19937 random(5);
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> n = randomUnit(random);
    const Mat3<double> reflection = Mat3<double>::Identity() - 2 * n * n.transpose();
    EXPECT_LT((lookUpOf(reflection, randomRotation(random)).matrix() - reflection.inverse()).norm(), 3e-15);
  }
}

TEST(LookUp, KeepsTheAnglesAmongLightViewAndNormal) {
  std::mt19937 random(6);
  for (int i = 0; i < 1000; ++i) {
    const auto lookUp = lookUpOf(randomJacobian(random), randomRotation(random));
    const auto light = asDirection(randomUnit(random)), view = asDirection(randomUnit(random));
    const auto normal = asDirection(lookUp.outwardNormal().raw());
    EXPECT_NEAR(dot(lookUp(light), lookUp(view)), dot(light, view), 3e-15);
    EXPECT_NEAR(dot(lookUp(light), lookUp(normal)), dot(light, normal), 3e-15);
    EXPECT_NEAR(dot(lookUp(view), lookUp(normal)), dot(view, normal), 3e-15);
  }
}

TEST(LookUp, TheDeformedNormalGoesToTheCapturedOne) {
  std::mt19937 random(7);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> j = randomJacobian(random), r0 = randomRotation(random);
    const auto lookUp = lookUpOf(j, r0);
    const Vec3<double> n = (j.inverse().transpose() * r0.col(2)).normalized(); // outward also under a mirror
    EXPECT_LT((lookUp.outwardNormal().raw() - n).norm(), 3e-15);
    EXPECT_LT((lookUp(asDirection(n)).raw() - r0.col(2)).norm(), 3e-15);
  }
}

// The reason for preferring polarFrame to the paper's.
TEST(LookUp, TurningTheFreeTangentChangesNothing) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> azimuth(0, 2 * std::numbers::pi);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> j = randomJacobian(random), r0 = randomRotation(random);
    const Mat3<double> turned =
        r0 * Eigen::AngleAxisd(azimuth(random), Vec3<double>::UnitZ()).toRotationMatrix();
    EXPECT_LT((lookUpOf(j, r0).matrix() - lookUpOf(j, turned).matrix()).norm(), 2e-15);
  }
}

// A 1:2 stretch makes the paper's frame turn by up to 3.2 degrees with the azimuth of u0, 1:4 by 10.6.
TEST(LookUp, ThePapersFrameTurnsWithTheFreeTangent) {
  const auto angleSpread = [](double stretch) {
    double least = 0, most = 0;
    for (double azimuth = 0; azimuth < std::numbers::pi; azimuth += 1e-3) {
      const Vec3<double> u0(std::cos(azimuth), std::sin(azimuth), 0), v0(-u0.y(), u0.x(), 0);
      const auto stretched = [&](const Vec3<double>& v) { return Vec3<double>(stretch * v.x(), v.y(), 0); };
      const auto frame = bisectorFrame<double>(stretched(u0), stretched(v0));
      const double turned = std::atan2(u0.cross(frame->u).z(), u0.dot(frame->u)) * 180 / std::numbers::pi;
      least = std::min(least, turned);
      most = std::max(most, turned);
    }
    return std::pair(least, most);
  };
  for (const auto& [stretch, degrees] : {std::pair(2., 3.190), std::pair(4., 10.550)}) {
    const auto [least, most] = angleSpread(stretch);
    EXPECT_NEAR(most, degrees, 0.001) << stretch;
    EXPECT_NEAR(least, -degrees, 0.001) << stretch;
  }
}

} // namespace
} // namespace surflect
