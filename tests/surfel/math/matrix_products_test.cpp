#include "surfel/math/matrix_products.h"

#include "surfel/math/padded_rows.h"
#include "tests/support/each_simd.h"
#include "tests/surfel/math/matrices.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace surflect {
namespace {

template <class Real>
PaddedRows<Real> multiplied(const PaddedRows<Real>& a, bool turned, const PaddedRows<Real>& b,
                            bool upper = false) {
  PaddedRows<Real> c(turned ? a.columns() : a.rows(), b.columns());
  multiply(MatrixProduct<Real>{a.row(0), turned ? 1 : a.stride(), turned ? a.stride() : 1, b.row(0),
                               b.stride(), c.row(0), c.stride(), c.rows(), b.rows(), b.stride(), upper});
  return c;
}

template <class Real> void expectProducts() {
  std::mt19937 generator(1);
  for (const size_t rows : {1, 3, 4, 61})
    for (const size_t inner : {1, 31, 32, 33, 192})
      for (const size_t columns : {1, 8, 20, 60})
        for (const bool turned : {false, true}) {
          const auto a = turned ? noise<Real>(inner, rows, generator) : noise<Real>(rows, inner, generator);
          const auto b = noise<Real>(inner, columns, generator);
          const auto product = [&] { return multiplied(a, turned, b); };
          const auto c = inSimd(Simd::scalar, product);
          for (size_t i = 0; i < rows; ++i)
            for (size_t j = 0; j < c.stride(); ++j) {
              double expected = 0, size = 0;
              for (size_t k = 0; k < inner; ++k) {
                const double part = double{turned ? a.row(k)[i] : a.row(i)[k]} * double{b.row(k)[j]};
                expected += part;
                size += std::abs(part);
              }
              ASSERT_NEAR(c.row(i)[j], expected, 2 * std::numeric_limits<Real>::epsilon() * size);
            }
          for (const Simd simd : EachSimd()) ASSERT_EQ(valuesOf(product()), valuesOf(c)) << nameOf(simd);
        }
}

TEST(MatrixProducts, ProductsAreThoseOfTheirMatrices) {
  expectProducts<float>();
  expectProducts<double>();
}

template <class Real> void expectUpperProducts() {
  std::mt19937 generator(4);
  for (const size_t size : {1, 8, 20, 61}) {
    const auto a = noise<Real>(40, size, generator);
    const auto whole = inSimd(Simd::scalar, [&] { return multiplied(a, true, a); });
    for (const Simd simd : EachSimd()) {
      const auto upper = multiplied(a, true, a, true);
      for (size_t i = 0; i < size; ++i)
        for (size_t j = i / 8 * 8; j < size; ++j)
          ASSERT_EQ(upper.row(i)[j], whole.row(i)[j]) << nameOf(simd) << ' ' << size;
    }
  }
}

TEST(MatrixProducts, UpperProductsAreOnTheDiagonalAndRightOfItThoseOfTheWhole) {
  expectUpperProducts<float>();
  expectUpperProducts<double>();
}

template <class Real> void expectScalarProducts() {
  std::mt19937 generator(5);
  for (const size_t rows : {1, 4, 7})
    for (const size_t length : {1, 8, 60}) {
      const auto a = noise<Real>(rows, length, generator), v = noise<Real>(1, length, generator);
      const auto products = [&] {
        std::vector<Real> result(rows);
        multiply(ScalarProducts<Real>{a.row(0), a.stride(), rows, v.row(0), v.stride(), result.data()});
        return result;
      };
      const std::vector<Real> plain = inSimd(Simd::scalar, products);
      for (size_t j = 0; j < rows; ++j) {
        double expected = 0, size = 0;
        for (size_t i = 0; i < length; ++i) {
          const double part = double{a.row(j)[i]} * double{v.row(0)[i]};
          expected += part;
          size += std::abs(part);
        }
        ASSERT_NEAR(plain[j], expected, 2 * std::numeric_limits<Real>::epsilon() * size);
      }
      for (const Simd simd : EachSimd()) ASSERT_EQ(products(), plain) << nameOf(simd);
    }
}

TEST(MatrixProducts, ScalarProductsAreThoseOfEachRow) {
  expectScalarProducts<float>();
  expectScalarProducts<double>();
}

TEST(PaddedProducts, EqualThoseOfEigen) {
  std::mt19937 generator(6);
  for (const auto& [rows, columns] : {std::pair(3, 5), {33, 17}, {70, 130}}) {
    const Eigen::MatrixXd a = randomMatrix(rows, columns, generator), b = randomMatrix(columns, 9, generator),
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
