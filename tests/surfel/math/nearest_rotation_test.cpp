#include "surfel/math/nearest_rotation.h"

#include "tests/support/random.h"

#include <gtest/gtest.h>

namespace surflect {
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
