#include "surfel/math/truncated_svd.h"

#include "tests/surfel/math/matrices.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

namespace surflect {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Random symmetric matrix with the given eigenvalues, scaled to trace 1.
MatrixXd gramOf(VectorXd values, std::mt19937& generator) {
  const auto size = static_cast<int>(values.size());
  const MatrixXd q = randomOrthogonal(size, generator);
  values /= values.sum();
  return q * values.asDiagonal() * q.transpose();
}

template <class Real> void expectOrthonormal(const MatrixXd& v) {
  EXPECT_LT((v.transpose() * v - MatrixXd::Identity(v.cols(), v.cols())).cwiseAbs().maxCoeff(),
            100 * std::numeric_limits<Real>::epsilon());
}

template <class Real> void expectStrongest(const MatrixXd& gram, double tolerated) {
  const MatrixXd v = matrixOf(dominantEigenvectors(rowsOf<Real>(gram), static_cast<Real>(tolerated)).vectors);
  expectOrthonormal<Real>(v);
  const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(gram).eigenvalues().reverse();
  Eigen::Index needed = 0;
  for (double left = 1; left > tolerated; ++needed) left -= values[needed];
  ASSERT_GE(v.cols(), needed);
  const double caught = (v.leftCols(needed).transpose() * gram * v.leftCols(needed)).trace();
  EXPECT_GT(caught, values.head(needed).sum() - 0.01 * tolerated - std::numeric_limits<Real>::epsilon() * 60);
}

TEST(StrongestVectors, HoldWhatEigenvectorsHold) {
  std::mt19937 generator(1);
  for (const int size : {1, 2, 5, 28, 60})
    for (const double falls : {0.1, 1., 3.}) {
      VectorXd values(size);
      for (int k = 0; k < size; ++k) values[k] = std::exp(-falls * k) + 1e-5;
      const MatrixXd gram = gramOf(values, generator);
      for (const double tolerated : {1e-1, 1e-2, 1e-3, 1e-4}) {
        expectStrongest<float>(gram, tolerated);
        expectStrongest<double>(gram, tolerated);
      }
    }
}

TEST(StrongestVectors, AreFoundWithoutTheRestWhereItIsWeak) {
  std::mt19937 generator(2);
  VectorXd values(60);
  for (int k = 0; k < 60; ++k) values[k] = std::exp(-1.5 * k) + 1e-6;
  EXPECT_LT(dominantEigenvectors(rowsOf<float>(gramOf(values, generator)), 1e-3f).vectors.columns(), 12u);
}

// Lanczos vectors of one start miss further eigenvectors of a repeated eigenvalue.
TEST(StrongestVectors, AreAllFoundWhereEigenvaluesRepeat) {
  std::mt19937 generator(3);
  const VectorXd alike = VectorXd::Ones(20);
  VectorXd pairs(20);
  for (int k = 0; k < 20; ++k) pairs[k] = std::exp(-k / 2);
  for (const VectorXd& values : {alike, pairs}) {
    const MatrixXd gram = gramOf(values, generator);
    for (const double tolerated : {0.3, 1e-2, 0.}) {
      expectOrthonormal<double>(matrixOf(dominantEigenvectors(rowsOf<double>(gram), tolerated).vectors));
      if (tolerated > 0) expectStrongest<double>(gram, tolerated);
    }
    EXPECT_EQ(dominantEigenvectors(rowsOf<double>(gram), 0.).vectors.columns(), 20u);
  }
}

TEST(StrongestVectors, AreNoMoreThanTheRank) {
  std::mt19937 generator(4);
  VectorXd values = VectorXd::Zero(30);
  values.head(3) << 3, 2, 1;
  EXPECT_EQ(dominantEigenvectors(rowsOf<double>(gramOf(values, generator)), 0.).vectors.columns(), 3u);
}

} // namespace

namespace {

using Eigen::MatrixXd;

// Random matrix whose singular values fall by a third from each to the next.
MatrixXd falling(int rows, int columns, std::mt19937& generator) {
  const int terms = std::min(rows, columns);
  Eigen::VectorXd values(terms);
  for (int k = 0; k < terms; ++k) values[k] = std::pow(2. / 3, k);
  return randomOrthogonal(rows, generator).leftCols(terms) * values.asDiagonal() *
         randomOrthogonal(columns, generator).leftCols(terms).transpose();
}

MatrixXd productOf(const TruncatedSvd<double>& svd) {
  MatrixXd sum = MatrixXd::Zero(svd.left.rows(), svd.right.rows());
  const MatrixXd left = matrixOf(svd.left), right = matrixOf(svd.right);
  for (size_t k = 0; k < svd.energies.size(); ++k)
    sum += std::sqrt(svd.energies[k]) * left.col(k) * right.col(k).transpose();
  return sum;
}

TEST(TruncatedSvd, AllTermsGiveTheMatrixAndItsSingularValues) {
  std::mt19937 generator(1);
  for (const auto& [rows, columns] : {std::pair(40, 12), {12, 40}, {7, 7}}) {
    const MatrixXd x = falling(rows, columns, generator);
    const TruncatedSvd<double> svd = truncatedSvd(rowsOf<double>(x), 0.);
    EXPECT_LT((productOf(svd) - x).norm(), 1e-7 * x.norm()) << rows << ' ' << columns;
    EXPECT_NEAR(svd.energy, x.squaredNorm(), 1e-12 * x.squaredNorm());
    ASSERT_EQ(svd.energies.size(), static_cast<size_t>(std::min(rows, columns)));
    for (size_t k = 0; k < svd.energies.size(); ++k)
      EXPECT_NEAR(std::sqrt(svd.energies[k]), std::pow(2. / 3, static_cast<double>(k)), 1e-7);
  }
}

TEST(TruncatedSvd, LeavesNoMoreThanIsTolerated) {
  std::mt19937 generator(2);
  const MatrixXd x = falling(60, 192, generator);
  size_t terms = 60;
  for (const double tolerated : {1e-8, 1e-5, 1e-2}) {
    const TruncatedSvd<double> svd = truncatedSvd(rowsOf<double>(x), tolerated * x.squaredNorm());
    EXPECT_LE((productOf(svd) - x).squaredNorm(), 1.01 * tolerated * x.squaredNorm()) << tolerated;
    EXPECT_LT(svd.energies.size(), terms) << tolerated;
    terms = svd.energies.size();
  }
}

} // namespace

} // namespace surflect
