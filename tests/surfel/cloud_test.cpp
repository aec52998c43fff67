#include "surfel/cloud.h"

#include "tests/support/random.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace surflect {

namespace {

using Tangents = Eigen::Matrix<double, 3, 2>;

// Tangents with angles between them of 3 to 177 degrees and lengths of 0.1 to 10.
Tangents randomTangents(std::mt19937& random) {
  std::uniform_real_distribution<double> exponent(-1, 1);
  for (;;) {
    const Vec3<double> u = randomUnit(random), v = randomUnit(random);
    if (u.cross(v).norm() < std::sin(3 * std::numbers::pi / 180)) continue;
    Tangents tangents;
    tangents << std::pow(10, exponent(random)) * u, std::pow(10, exponent(random)) * v;
    return tangents;
  }
}

// The pair of orthonormal vectors nearest to the columns, by singular value decomposition.
Tangents nearestOrthonormal(const Tangents& tangents) {
  const Eigen::JacobiSVD<Tangents, Eigen::FullPivHouseholderQRPreconditioner> svd(
      tangents, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU().leftCols<2>() * svd.matrixV().transpose();
}

Tangents tangentsOf(const OrthonormalFrame<double>& frame) {
  Tangents tangents;
  tangents << frame.u, frame.v;
  return tangents;
}

Mat3<double> matrixOf(const OrthonormalFrame<double>& frame) {
  Mat3<double> matrix;
  matrix << frame.u, frame.v, frame.n;
  return matrix;
}

double roundTripError(const Vec3<double>& n) {
  const Rodrigues r0 = rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(n));
  return (rotationOf<double>(r0).col(2) - n).norm();
}

TEST(Rodrigues, AMillionNormalsComeBack) {
  std::mt19937 random(1);
  double worst = 0, longest = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const Vec3<double> n = randomUnit(random);
    const Rodrigues r0 = rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(n));
    worst = std::max(worst, (rotationOf<double>(r0).col(2) - n).norm());
    longest = std::max(longest, std::hypot(double{r0.x}, double{r0.y}));
  }
  EXPECT_LT(worst, 1.1e-7); // float32 keeps 9e-6 degrees
  EXPECT_LE(longest, 1 + 1e-7);
}

TEST(Rodrigues, AxesComeBack) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1., -1.}) EXPECT_EQ(roundTripError(sign * Vec3<double>::Unit(axis)), 0);
}

TEST(Rodrigues, NormalsNearThePolesComeBack) {
  std::mt19937 random(2);
  for (double tilt = 1e-12; tilt < 0.1; tilt *= 3)
    for (const double pole : {1., -1.}) {
      const Vec3<double> n = (pole * Vec3<double>::UnitZ() + tilt * randomUnit(random)).normalized();
      EXPECT_LT(roundTripError(n), 1e-7 * tilt + 1e-15) << tilt << ' ' << pole;
    }
}

TEST(Rodrigues, FramesAreRightHandedRotations) {
  std::mt19937 random(3);
  for (int i = 0; i < 1000; ++i) {
    const Mat3<double> r =
        rotationOf<double>(rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(randomUnit(random))));
    EXPECT_LT((r * r.transpose() - Mat3<double>::Identity()).norm(), 1e-15);
    EXPECT_NEAR(r.determinant(), 1, 1e-15);
  }
}

TEST(PolarFrame, IsThePolarFactorOfTheUnnormalisedTangents) {
  std::mt19937 random(4);
  for (int i = 0; i < 10000; ++i) {
    const Tangents tangents = randomTangents(random);
    const auto frame = polarFrame<double>(tangents.col(0), tangents.col(1));
    ASSERT_TRUE(frame);
    EXPECT_LT((tangentsOf(*frame) - nearestOrthonormal(tangents)).norm(), 7e-15);
  }
}

TEST(BisectorFrame, SolvesProcrustesForTheNormalisedTangents) {
  std::mt19937 random(5);
  for (int i = 0; i < 10000; ++i) {
    const Tangents tangents = randomTangents(random);
    const auto frame = bisectorFrame<double>(tangents.col(0), tangents.col(1));
    ASSERT_TRUE(frame);
    const Tangents unit = tangents.colwise().normalized();
    EXPECT_LT((tangentsOf(*frame) - nearestOrthonormal(unit)).norm(), 1.2e-14);
  }
}

TEST(Frames, AreRightHandedAndOrthonormal) {
  std::mt19937 random(6);
  for (int i = 0; i < 10000; ++i) {
    const Tangents tangents = randomTangents(random);
    for (const auto& frame : {polarFrame<double>(tangents.col(0), tangents.col(1)),
                              bisectorFrame<double>(tangents.col(0), tangents.col(1))}) {
      const Mat3<double> m = matrixOf(*frame);
      EXPECT_LT((m * m.transpose() - Mat3<double>::Identity()).norm(), 1e-14);
      EXPECT_NEAR(m.determinant(), 1, 5e-15);
    }
  }
}

TEST(Frames, AgreeOnOrthogonalTangentsOfOneLength) {
  std::mt19937 random(7);
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> u = randomUnit(random), v = u.cross(randomUnit(random)).normalized();
    const Mat3<double> polar = matrixOf(*polarFrame<double>(3 * u, 3 * v));
    EXPECT_LT((polar - matrixOf(*bisectorFrame<double>(3 * u, 3 * v))).norm(), 1.5e-15);
    EXPECT_LT((polar.col(0) - u).norm() + (polar.col(1) - v).norm(), 1.5e-15);
  }
}

TEST(PolarFrame, DoesNotDependOnTheLengthOfBothTangents) {
  std::mt19937 random(8);
  for (const double scale : {1e-300, 1e-30, 1e30, 1e300}) {
    const Tangents t = randomTangents(random);
    const auto frame = polarFrame<double>(t.col(0), t.col(1));
    const auto scaled = polarFrame<double>(scale * t.col(0), scale * t.col(1));
    ASSERT_TRUE(scaled);
    EXPECT_LT((matrixOf(*frame) - matrixOf(*scaled)).norm(), 5e-16);
  }
}

TEST(Frames, AreRefusedWhereTangentsSpanNoPlane) {
  const Vec3<double> u(1, 2, 3), zero(0, 0, 0);
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<Vec3<double>, Vec3<double>>> dead = {
      {u, 2 * u},   {u, -u},          {u, zero},        {zero, zero},
      {u, u * 0.1}, {u, {inf, 0, 0}}, {{0, nan, 0}, u}, {u, {0, 0, nan}}};
  for (const auto& [a, b] : dead) {
    EXPECT_FALSE(polarFrame<double>(a, b)) << a.transpose() << " | " << b.transpose();
    EXPECT_FALSE(bisectorFrame<double>(a, b)) << a.transpose() << " | " << b.transpose();
  }
}

} // namespace

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
