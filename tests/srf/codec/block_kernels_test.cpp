#include "srf/codec/block_kernels.h"

#include "srf/codec/padded_rows.h"
#include "tests/srf/codec/synthetic.h"
#include "tests/support/each_simd.h"

namespace surflect::codec {
namespace {

template <class Real> PaddedRows<Real> noise(size_t rows, size_t columns, std::mt19937& generator) {
  std::normal_distribution<Real> normal;
  PaddedRows<Real> m(rows, columns);
  for (size_t i = 0; i < rows; ++i) std::generate_n(m.row(i), columns, [&] { return normal(generator); });
  return m;
}

template <class Real> std::vector<Real> valuesOf(const PaddedRows<Real>& m) {
  return {m.row(0), m.row(0) + m.rows() * m.stride()};
}

template <class Real>
PaddedRows<Real> productOf(const PaddedRows<Real>& a, bool turned, const PaddedRows<Real>& b,
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
          const auto product = [&] { return productOf(a, turned, b); };
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

TEST(BlockKernels, ProductsAreThoseOfTheirMatrices) {
  expectProducts<float>();
  expectProducts<double>();
}

template <class Real> void expectUpperProducts() {
  std::mt19937 generator(4);
  for (const size_t size : {1, 8, 20, 61}) {
    const auto a = noise<Real>(40, size, generator);
    const auto whole = inSimd(Simd::scalar, [&] { return productOf(a, true, a); });
    for (const Simd simd : EachSimd()) {
      const auto upper = productOf(a, true, a, true);
      for (size_t i = 0; i < size; ++i)
        for (size_t j = i / 8 * 8; j < size; ++j)
          ASSERT_EQ(upper.row(i)[j], whole.row(i)[j]) << nameOf(simd) << ' ' << size;
    }
  }
}

TEST(BlockKernels, UpperProductsAreOnTheDiagonalAndRightOfItThoseOfTheWhole) {
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

TEST(BlockKernels, ScalarProductsAreThoseOfEachRow) {
  expectScalarProducts<float>();
  expectScalarProducts<double>();
}

// `error`: relative error of sums of that many terms.
template <class Real> void expectRounding(size_t columns, Real largestLast, double error) {
  std::mt19937 generator(2);
  const auto values = noise<Real>(50, columns, generator);
  std::vector<Real> weights(50), inverse(50);
  for (size_t i = 0; i < 50; ++i)
    inverse[i] = 1 / (weights[i] = Real(0.5) + Real(0.25) * static_cast<Real>(i % 3));
  const auto errors = [&] {
    std::vector<Real> result(roundings * values.stride());
    Rounding<Real> job{values.row(0),
                       50,
                       values.stride(),
                       weights.data(),
                       inverse.data(),
                       {7, 7, 7, 127, 127, 127, 127, 127, largestLast},
                       {1, Real(0.75), Real(0.5), 1, Real(0.875), Real(0.8125), Real(1.125), Real(1.25), 1},
                       result.data()};
    roundingErrors(job);
    for (size_t r = 0; r < roundings; ++r)
      for (size_t k = 0; k < columns; ++k) {
        double peak = 0, expected = 0;
        const auto stored = [&](size_t i) { return double{values.row(i)[k] * inverse[i]}; };
        for (size_t i = 0; i < 50; ++i) peak = std::max(peak, std::abs(stored(i)));
        const double step = peak * double{job.clip[r] / job.last[r]};
        for (size_t i = 0; i < 50; ++i) {
          const double last = double{job.last[r]};
          const double level = std::round(std::clamp(stored(i) / step, -last, last));
          expected += std::pow((stored(i) - step * level) * double{weights[i]}, 2);
        }
        EXPECT_NEAR(result[r * values.stride() + k], expected, error * expected) << r << ' ' << k;
      }
    return result;
  };
  for (const Simd simd : EachSimd()) EXPECT_EQ(errors(), inSimd(Simd::scalar, errors)) << nameOf(simd);
}

TEST(BlockKernels, RoundingLeavesWhatLevelsAreAwayFromTheValues) {
  for (const size_t columns : {11, 20, 32}) {
    expectRounding<double>(columns, 32639, 2e-15);
    expectRounding<float>(columns, 127, 7e-6);
  }
}

TEST(BlockKernels, ErrorsAreThoseOfEachChannelAndLight) {
  std::mt19937 generator(3);
  const auto x = noise<float>(15, 20, generator);
  const auto perLevel = noise<double>(3, 20, generator);
  std::vector<double> levels(15 * 3);
  for (double& level : levels) level = std::round(3 * std::normal_distribution<double>()(generator));
  std::vector<double> first;
  for (const Simd simd : EachSimd()) {
    std::vector<double> sums(4 * x.stride());
    blockErrors({x.row(0), 5, x.stride(), levels.data(), perLevel.row(0), 3, 0.8, sums.data(),
                 sums.data() + 3 * x.stride()});
    if (first.empty()) first = sums;
    EXPECT_EQ(sums, first) << nameOf(simd);
  }
  for (size_t l = 0; l < 20; ++l) {
    double squares[3] = {}, clipped = 0;
    for (size_t i = 0; i < 15; ++i) {
      const double from = double{x.row(i)[l]};
      double to = 0;
      for (size_t k = 0; k < 3; ++k) to += levels[(i / 3 * 3 + k) * 3 + i % 3] * perLevel.row(k)[l];
      squares[i % 3] += (from - to) * (from - to);
      clipped += std::pow(std::clamp(from, 0., 0.8) - std::clamp(to, 0., 0.8), 2);
    }
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(first[c * x.stride() + l], squares[c], 1e-13 * squares[c]);
    EXPECT_NEAR(first[3 * x.stride() + l], clipped, 1e-13 * (1 + clipped));
  }
}

} // namespace
} // namespace surflect::codec
