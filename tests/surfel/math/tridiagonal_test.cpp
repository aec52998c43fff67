#include "surfel/math/tridiagonal.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace surflect {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd tridiagonal(const VectorXd& diagonal, const VectorXd& beside) {
  MatrixXd t = diagonal.asDiagonal();
  t.diagonal(1) = beside;
  t.diagonal(-1) = beside;
  return t;
}

template <class Real> void expectSpectrum(const VectorXd& diagonal, const VectorXd& beside) {
  const Eigen::VectorX<Real> a = diagonal.cast<Real>(), b = beside.cast<Real>();
  const auto spectrum = tridiagonalSpectrum<Real>({a.data(), static_cast<size_t>(a.size())},
                                                  {b.data(), static_cast<size_t>(b.size())});
  const MatrixXd t = tridiagonal(a.template cast<double>(), b.template cast<double>());
  const VectorXd expected = Eigen::SelfAdjointEigenSolver<MatrixXd>(t).eigenvalues().reverse();
  const auto size = t.rows();
  const double error = 50 * std::numeric_limits<Real>::epsilon();
  const double largest = std::max(expected.cwiseAbs().maxCoeff(), 1e-30);
  const MatrixXd z =
      MatrixXd::NullaryExpr(size, size, [&](auto k, auto i) { return double{spectrum.vectors.row(k)[i]}; });
  for (Eigen::Index k = 0; k < size; ++k) {
    EXPECT_NEAR(spectrum.values[k], expected[k], error * largest) << k << " of " << size;
    const VectorXd v = z.row(k).transpose();
    EXPECT_LT((t * v - double{spectrum.values[k]} * v).norm(), error * largest) << k << " of " << size;
  }
  EXPECT_LT((z * z.transpose() - MatrixXd::Identity(size, size)).cwiseAbs().maxCoeff(), error);
}

void expectBoth(const VectorXd& diagonal, const VectorXd& beside) {
  expectSpectrum<float>(diagonal, beside);
  expectSpectrum<double>(diagonal, beside);
}

TEST(TridiagonalSpectrum, IsThatOfTheWholeMatrix) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  const auto noise = [&](Eigen::Index size) {
    return VectorXd::NullaryExpr(size, [&] { return normal(generator); });
  };
  for (const int size : {1, 2, 3, 12, 19, 60}) expectBoth(noise(size), noise(size - 1));
}

// Decaying matrices as from a Lanczos process: entries of a smooth block fall off within a few rows.
TEST(TridiagonalSpectrum, IsFoundWhereTheMatrixFallsOff) {
  for (const double falls : {0.3, 1., 3.}) {
    const VectorXd a =
        VectorXd::NullaryExpr(20, [&](auto i) { return std::exp(-falls * static_cast<double>(i)); });
    expectBoth(a, 0.3 * a.head(19));
  }
}

TEST(TridiagonalSpectrum, IsFoundWhereTheMatrixIsSeveralOrHasEqualValues) {
  VectorXd beside = VectorXd::Ones(11);
  beside[3] = beside[7] = 0;
  expectBoth(VectorXd::Ones(12), beside);
  expectBoth(VectorXd::Ones(12), VectorXd::Zero(11));
  expectBoth(VectorXd::Zero(12), VectorXd::Zero(11));
  expectBoth(VectorXd::Zero(12), VectorXd::Ones(11));
}

} // namespace
} // namespace surflect
