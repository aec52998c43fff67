#include "srf/codec/block_kernels.h"

#include "tests/srf/codec/synthetic.h"
#include "tests/support/each_simd.h"
#include "tests/surfel/math/matrices.h"

namespace surflect::codec {
namespace {

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
