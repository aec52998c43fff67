#include "render/lightfield/lfm/pca.h"

#include "tests/surfel/math/matrices.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace surflect::lfm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd withValues(int rows, int columns, const std::vector<double>& values, std::mt19937& generator) {
  const auto orthogonal = [&](int size) -> MatrixXd {
    return randomMatrix(size, size, generator).householderQr().householderQ();
  };
  const auto terms = static_cast<Eigen::Index>(values.size());
  return orthogonal(rows).leftCols(terms) * Eigen::Map<const VectorXd>(values.data(), terms).asDiagonal() *
         orthogonal(columns).leftCols(terms).transpose();
}

std::vector<double> fallingValues(int terms, double ratio) {
  std::vector<double> values;
  for (int k = 0; k < terms; ++k) values.push_back(std::pow(ratio, k));
  return values;
}

PlainFactors leading(const MatrixXd& x, size_t terms, double negligible = 0) {
  return leadingTerms(rowsOf<float>(x), terms, negligible);
}

TEST(LeadingTerms, AreThoseOfTheSingularValueDecomposition) {
  std::mt19937 generator(1);
  for (const auto& [rows, columns] : {std::pair(300, 120), {120, 300}, {70, 70}, {5, 90}, {40, 1}}) {
    const MatrixXd x =
        withValues(rows, columns, fallingValues(std::min({rows, columns, 60}), 0.8), generator);
    const Eigen::JacobiSVD<MatrixXd> svd(x, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const size_t terms = std::min<size_t>(4, std::min(rows, columns));
    const PlainFactors factors = leading(x, terms);
    ASSERT_EQ(factors.terms(), terms);
    const MatrixXd u = matrixOf(factors.surface), v = matrixOf(factors.view);
    for (size_t k = 0; k < terms; ++k) {
      const double sigma = svd.singularValues()[k];
      EXPECT_NEAR(u.col(k).norm(), sigma, 1e-6);
      EXPECT_NEAR(std::abs(u.col(k).dot(svd.matrixU().col(k))), sigma, 2e-6);
      EXPECT_NEAR(std::abs(v.col(k).dot(svd.matrixV().col(k))), 1, 2e-6);
    }
    EXPECT_LT((v.transpose() * v - MatrixXd::Identity(terms, terms)).norm(), 1e-6);
  }
}

TEST(LeadingTerms, OfEqualSingularValuesAreAllFound) {
  std::mt19937 generator(3);
  std::vector<double> values(20, 1.0);
  values.resize(80, 0.5);
  const MatrixXd u = matrixOf(leading(withValues(100, 90, values, generator), 25).surface);
  ASSERT_EQ(u.cols(), 25);
  for (Eigen::Index k = 0; k < 25; ++k) EXPECT_NEAR(u.col(k).norm(), k < 20 ? 1 : 0.5, 1e-6) << k;
}

TEST(LeadingTerms, AreNoMoreThanTheRank) {
  std::mt19937 generator(4);
  for (const int rank : {0, 1, 3, 17}) {
    const MatrixXd x = withValues(80, 60, fallingValues(rank, 0.9), generator);
    const PlainFactors factors = leading(x, 40);
    EXPECT_EQ(factors.terms(), static_cast<size_t>(rank));
    EXPECT_LT((matrixOf(factors.surface) * matrixOf(factors.view).transpose() - x).norm(), 2e-6) << rank;
  }
}

TEST(LeadingTerms, AreTheFewestThatLeaveWhatIsNegligible) {
  std::mt19937 generator(5);
  const MatrixXd x = withValues(90, 140, fallingValues(50, 0.75), generator);
  for (const size_t terms : {1u, 4u, 9u}) {
    const double rest = std::pow(0.75, 2 * terms) * (1 - std::pow(0.75, 100 - 2 * terms)) / (1 - 0.5625);
    EXPECT_EQ(leading(x, 50, 1.0001 * rest).terms(), terms);
    EXPECT_EQ(leading(x, 50, 0.9999 * rest).terms(), terms + 1);
  }
}

} // namespace
} // namespace surflect::lfm
