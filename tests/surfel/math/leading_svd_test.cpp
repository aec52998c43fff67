#include "surfel/math/leading_svd.h"

#include "surfel/math/padded_products.h"
#include "tests/surfel/math/matrices.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace surflect {
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

MatrixXd leadingProduct(const TruncatedSvd<double>& svd) {
  VectorXd lengths(svd.energies.size());
  for (size_t k = 0; k < svd.energies.size(); ++k) lengths[k] = std::sqrt(svd.energies[k]);
  return matrixOf(svd.left) * lengths.asDiagonal() * matrixOf(svd.right).transpose();
}

TEST(LeadingSvd, EqualsTheDecompositionOfEigen) {
  std::mt19937 generator(1);
  for (const auto& [rows, columns] : {std::pair(300, 120), {120, 300}, {70, 70}, {5, 90}, {40, 1}}) {
    const MatrixXd x =
        withValues(rows, columns, fallingValues(std::min({rows, columns, 60}), 0.8), generator);
    // Right singular vectors are eigenvectors of x^T x, in ascending order.
    const Eigen::SelfAdjointEigenSolver<MatrixXd> all(x.transpose() * x);
    const size_t terms = std::min<size_t>(4, std::min(rows, columns));
    const TruncatedSvd<double> svd = leadingSvd(rowsOf<double>(x), terms);
    ASSERT_EQ(svd.energies.size(), terms);
    const MatrixXd left = matrixOf(svd.left), right = matrixOf(svd.right);
    for (size_t k = 0; k < terms; ++k) {
      const auto place = columns - 1 - static_cast<Eigen::Index>(k);
      const VectorXd vector = all.eigenvectors().col(place);
      const double value = std::sqrt(all.eigenvalues()[place]);
      EXPECT_NEAR(std::sqrt(svd.energies[k]), value, 1e-10);
      EXPECT_NEAR(std::abs(left.col(k).dot(x * vector)), value, 1e-8);
      EXPECT_NEAR(std::abs(right.col(k).dot(vector)), 1, 1e-8);
    }
    EXPECT_LT((left.transpose() * left - MatrixXd::Identity(terms, terms)).norm(), 1e-7);
    EXPECT_LT((right.transpose() * right - MatrixXd::Identity(terms, terms)).norm(), 1e-10);
  }
}

TEST(LeadingSvd, InSinglePrecisionTermsAreAsPrecise) {
  std::mt19937 generator(2);
  const std::vector<double> values = fallingValues(60, 0.7);
  const TruncatedSvd<float> svd = leadingSvd(rowsOf<float>(withValues(200, 260, values, generator)), 6);
  ASSERT_EQ(svd.energies.size(), 6u);
  for (size_t k = 0; k < 6; ++k) EXPECT_NEAR(std::sqrt(svd.energies[k]), values[k], 1e-6);
}

TEST(LeadingSvd, FindsEqualSingularValues) {
  std::mt19937 generator(3);
  std::vector<double> values(20, 1.0);
  values.resize(80, 0.5);
  const TruncatedSvd<double> svd = leadingSvd(rowsOf<double>(withValues(100, 90, values, generator)), 25);
  ASSERT_EQ(svd.energies.size(), 25u);
  for (size_t k = 0; k < 25; ++k) EXPECT_NEAR(std::sqrt(svd.energies[k]), k < 20 ? 1 : 0.5, 1e-9) << k;
}

TEST(LeadingSvd, HasNoMoreTermsThanTheRank) {
  std::mt19937 generator(4);
  for (const int rank : {0, 1, 3, 17}) {
    const MatrixXd x = withValues(80, 60, fallingValues(rank, 0.9), generator);
    const TruncatedSvd<double> svd = leadingSvd(rowsOf<double>(x), 40);
    EXPECT_EQ(svd.energies.size(), static_cast<size_t>(rank));
    EXPECT_LT((leadingProduct(svd) - x).norm(), 1e-9) << rank;
    EXPECT_EQ(leadingSvd(rowsOf<float>(x), 40).energies.size(), static_cast<size_t>(rank));
  }
}

TEST(LeadingSvd, TakesTheFewestTermsThatLeaveWhatIsTolerated) {
  std::mt19937 generator(5);
  const MatrixXd x = withValues(90, 140, fallingValues(50, 0.75), generator);
  for (const size_t terms : {1u, 4u, 9u}) {
    const double rest = std::pow(0.75, 2 * terms) * (1 - std::pow(0.75, 100 - 2 * terms)) / (1 - 0.5625);
    EXPECT_EQ(leadingSvd(rowsOf<double>(x), 50, 1.0001 * rest).energies.size(), terms);
    EXPECT_EQ(leadingSvd(rowsOf<double>(x), 50, 0.9999 * rest).energies.size(), terms + 1);
  }
}

TEST(PaddedProducts, EqualThoseOfEigen) {
  std::mt19937 generator(6);
  for (const auto& [rows, columns] : {std::pair(3, 5), {33, 17}, {70, 130}}) {
    const MatrixXd a = randomMatrix(rows, columns, generator), b = randomMatrix(columns, 9, generator),
                   c = randomMatrix(rows, 11, generator);
    EXPECT_LT((matrixOf(product(rowsOf<double>(a), rowsOf<double>(b))) - a * b).norm(),
              1e-12 * a.norm() * b.norm());
    EXPECT_LT((matrixOf(innerProducts(rowsOf<double>(a), rowsOf<double>(c))) - a.transpose() * c).norm(),
              1e-12 * a.norm() * c.norm());
    EXPECT_EQ(matrixOf(transposed(rowsOf<double>(a))), a.transpose());
  }
}

} // namespace
} // namespace surflect
