#include "srf/planes/basis.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::planes {
namespace {

Eigen::MatrixXf randomSamples(Eigen::Index rows, Eigen::Index columns) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  Eigen::MatrixXf samples(rows, columns);
  for (Eigen::Index i = 0; i < samples.size(); ++i)
    samples.data()[i] = uniform(random) / static_cast<float>(1 + i % rows); // variances differ
  return samples;
}

TEST(Planes, EncodingIsInvertedAndAsSteepAtBlackAsSrgb) {
  for (int i = 0; i <= 1000; ++i) {
    const float linear = static_cast<float>(i) / 1000;
    EXPECT_NEAR(decoded(encoded(linear)), linear, 2e-7f);
  }
  EXPECT_NEAR((encoded(1e-5f) - encoded(0)) / 1e-5f, 12.92f, 0.05f);
  EXPECT_EQ(decoded(-1), 0);
}

TEST(Planes, ABasisIsOrthonormalAndAsManyPlanesAsRowsLoseNothing) {
  const Eigen::MatrixXf samples = randomSamples(12, 500);
  const Basis basis = principalBasis(momentsOf(samples), 100);
  ASSERT_EQ(basis.planes(), 12);
  const Eigen::MatrixXf identity = basis.vectors.transpose() * basis.vectors;
  EXPECT_LT((identity - Eigen::MatrixXf::Identity(12, 12)).cwiseAbs().maxCoeff(), 1e-6f);
  const Eigen::MatrixXf centred = samples.colwise() - basis.mean;
  EXPECT_LT((basis.vectors * (basis.vectors.transpose() * centred) - centred).cwiseAbs().maxCoeff(), 2e-6f);
}

// [Pearson 1901]: the mean square that k planes leave is the sum of the other variances, and no other k leave
// less.
TEST(Planes, FewPlanesLeaveTheSmallestVariances) {
  const Eigen::MatrixXf samples = randomSamples(12, 500);
  const Moments moments = momentsOf(samples);
  for (const Eigen::Index planes : {1, 3, 6}) {
    const Basis basis = principalBasis(moments, planes);
    const Eigen::MatrixXf centred = samples.colwise() - basis.mean;
    const Eigen::MatrixXf lost = centred - basis.vectors * (basis.vectors.transpose() * centred);
    const Eigen::MatrixXd kept =
        basis.vectors.cast<double>().transpose() * moments.covariance * basis.vectors.cast<double>();
    EXPECT_NEAR(static_cast<double>(lost.squaredNorm()) / 500, moments.covariance.trace() - kept.trace(),
                1e-6);
    const Eigen::MatrixXf first = samples.topRows(planes);
    EXPECT_GE(kept.trace(), moments.covariance.diagonal().head(planes).sum());
  }
}

TEST(Planes, HalvingKeepsTheMeanOfEvenSizesAndRoundsOddOnesUp) {
  Planes planes{4, 2, {{1, 2, 3, 4, 5, 6, 7, 8}}};
  const Planes half = halved(planes);
  EXPECT_EQ(half.width, 2);
  EXPECT_EQ(half.height, 1);
  EXPECT_EQ(half.values[0], (std::vector<float>{3.5f, 5.5f}));
  const Planes odd = halved({3, 1, {{1, 2, 9}}});
  EXPECT_EQ(odd.width, 2);
  EXPECT_EQ(odd.values[0], (std::vector<float>{1.5f, 9}));
}

} // namespace
} // namespace surflect::planes
