// Seeded random values for tests.
#pragma once

#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <random>

namespace surflect {

// Unit vector, uniform over the sphere.
template <class T = double> Vec3<T> randomUnit(std::mt19937& random) {
  std::normal_distribution<T> normal;
  const T x = normal(random), y = normal(random), z = normal(random);
  return Vec3<T>(x, y, z).normalized();
}

// Rotation, uniform over all rotations.
inline Mat3<double> randomRotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
  return Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
}

// A rotation that takes z to a unit vector.
template <class T> Mat3<T> turnFromZ(const Vec3<T>& towards) {
  const Vec3<T> x = towards.unitOrthogonal();
  Mat3<T> turn;
  turn << x, towards.cross(x), towards;
  return turn;
}

} // namespace surflect
