#include "surfel/math/truncated_svd.h"

#include "tests/surfel/math/matrices.h"

#include <gtest/gtest.h>

namespace surflect {
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
