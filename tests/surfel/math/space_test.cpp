#include "surfel/math/space.h"

#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect {

namespace {

template <class A, class B>
concept Addable = requires(A a, B b) {
  a + b;
};
template <class A, class B>
concept Subtractable = requires(A a, B b) {
  a - b;
};
template <class A, class B>
concept Dottable = requires(A a, B b) {
  dot(a, b);
};
template <class A, class B>
concept Comparable = requires(A a, B b) {
  a == b;
};
template <class Transform, class X>
concept Applies = requires(Transform transform, X x) {
  transform(x);
};
template <class A, class B>
concept Composes = requires(A a, B b) {
  a* b;
};

using PointA = Point3<AcquisitionSpace>;
using PointO = Point3<ObjectSpace>;
using DirectionA = Direction3<AcquisitionSpace>;
using DirectionO = Direction3<ObjectSpace>;
using NormalO = Normal3<ObjectSpace>;
using ObjectFromAcquisition = Rigid<ObjectSpace, AcquisitionSpace>;
using CameraFromObject = Rigid<CameraSpace, ObjectSpace>;

// Allowed operations ...
static_assert(Subtractable<PointA, PointA> && Addable<PointA, DirectionA> && Addable<DirectionA, DirectionA>);
static_assert(Dottable<DirectionO, DirectionO> && Dottable<NormalO, DirectionO>);
static_assert(Applies<ObjectFromAcquisition, PointA> && Applies<ObjectFromAcquisition, DirectionA>);
static_assert(Composes<CameraFromObject, ObjectFromAcquisition>);

// ... mixing spaces ...
static_assert(!Subtractable<PointA, PointO> && !Addable<PointA, DirectionO>);
static_assert(!Addable<DirectionA, DirectionO>);
static_assert(!Dottable<DirectionA, DirectionO> && !Dottable<NormalO, DirectionA>);
static_assert(!Comparable<PointA, PointO>);
static_assert(!std::is_convertible_v<PointA, PointO> && !std::is_assignable_v<PointO&, PointA>);
static_assert(!std::is_constructible_v<PointO, PointA>);
static_assert(!Applies<ObjectFromAcquisition, PointO> && !Applies<ObjectFromAcquisition, DirectionO>);
static_assert(!Composes<ObjectFromAcquisition, CameraFromObject>);

// ... mixing kinds, and mixing with bare vectors, is not.
static_assert(!Addable<PointA, PointA> && !Addable<DirectionA, PointA>);
static_assert(!Dottable<PointA, PointA> && !Dottable<PointA, DirectionA>);
static_assert(!std::is_convertible_v<DirectionO, NormalO> && !std::is_convertible_v<DirectionO, PointO>);
static_assert(!std::is_convertible_v<Vec3<float>, PointO> && !std::is_convertible_v<PointO, Vec3<float>>);
static_assert(!Applies<CameraFromObject, NormalO>); // normals need their own way

static_assert(std::is_same_v<decltype(PointA() - PointA()), DirectionA>);
static_assert(std::is_same_v<decltype(std::declval<CameraFromObject>()(PointO())), Point3<CameraSpace>>);

template <class To, class From> Rigid<To, From> randomRigid(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
  return {q.normalized().toRotationMatrix(), {normal(random), normal(random), normal(random)}};
}

TEST(Rigid, InverseUndoes) {
  std::mt19937 random(1);
  for (int i = 0; i < 100; ++i) {
    const auto objectFromAcquisition = randomRigid<ObjectSpace, AcquisitionSpace>(random);
    const Point3<AcquisitionSpace, double> p(i, -2, 3);
    const auto back = objectFromAcquisition.inverse()(objectFromAcquisition(p));
    EXPECT_LT(length(back - p), 1.2e-13);
  }
}

TEST(Rigid, ProductActsLikeOneAfterTheOther) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const auto objectFromAcquisition = randomRigid<ObjectSpace, AcquisitionSpace>(random);
    const auto cameraFromObject = randomRigid<CameraSpace, ObjectSpace>(random);
    const Point3<AcquisitionSpace, double> p(1, i, -2);
    const auto product = cameraFromObject * objectFromAcquisition;
    EXPECT_LT(length(product(p) - cameraFromObject(objectFromAcquisition(p))), 6e-14);
  }
}

TEST(Rigid, DirectionsAreNotTranslated) {
  std::mt19937 random(3);
  const auto objectFromAcquisition = randomRigid<ObjectSpace, AcquisitionSpace>(random);
  const Point3<AcquisitionSpace, double> a(1, 2, 3), b(-2, 0, 5);
  const auto difference = objectFromAcquisition(b) - objectFromAcquisition(a);
  EXPECT_LT((difference.raw() - objectFromAcquisition(b - a).raw()).norm(), 2e-15);
}

} // namespace

namespace {

// Q is the nearest rotation to M where it is a rotation and Q^T M is symmetric and positive [Higham 1986].
TEST(NearestRotation, IsThePolarFactor) {
  std::mt19937 random(1);
  for (const double noise : {0., 1e-14, 1e-8, 1e-4, 1e-2}) {
    std::uniform_real_distribution<double> uniform(-noise, noise);
    for (int i = 0; i < 1000; ++i) {
      Mat3<double> m = randomRotation(random);
      for (double& value : m.reshaped()) value += uniform(random);
      const Mat3<double> q = nearestRotation(m), p = q.transpose() * m;
      EXPECT_LT((q.transpose() * q - Mat3<double>::Identity()).cwiseAbs().maxCoeff(), 1e-15);
      EXPECT_LT((p - p.transpose()).cwiseAbs().maxCoeff(), 1e-15);
      EXPECT_GT(q.determinant(), 0);
      EXPECT_GT(p.diagonal().minCoeff(), 0.9);
    }
  }
}

} // namespace

} // namespace surflect
