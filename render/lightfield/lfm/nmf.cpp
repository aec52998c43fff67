#include "render/lightfield/lfm/nmf.h"

#include "render/lightfield/lfm/pca.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

// Smaller factors become 0, before products of them take the slow path of denormal numbers.
constexpr float kNegligible = 1e-18f;

// Strictly positive, with a mean of 1.
PaddedRows<float> randomFactors(size_t rows, size_t terms, std::mt19937_64& random) {
  PaddedRows<float> factors(rows, terms);
  for (size_t i = 0; i < rows; ++i)
    for (size_t k = 0; k < terms; ++k)
      factors.row(i)[k] = static_cast<float>(0.5 + static_cast<double>(random() >> 11) * 0x1p-53);
  return factors;
}

// u_k <- u_k n_k / (G u)_k, kRepeats times, where G is given by its pairs. Factors whose denominator vanishes
// become 0.
// [Chen 2002, Appendix: U_n]
void update(float* u, const float* numerators, const float* pairs, size_t terms) {
  std::vector<float> denominators(terms);
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    std::ranges::fill(denominators, 0.0f);
    const float* g = pairs;
    for (size_t k = 0; k < terms; ++k)
      for (size_t l = k; l < terms; ++l, ++g) {
        denominators[k] += *g * u[l];
        if (l != k) denominators[l] += *g * u[k];
      }
    for (size_t k = 0; k < terms; ++k) {
      u[k] = denominators[k] > 0 ? u[k] * numerators[k] / denominators[k] : 0;
      if (u[k] < kNegligible) u[k] = 0;
    }
  }
}

// -2 u n + u' G u: what a row adds to the squared error beyond its own squares.
double errorOf(const float* u, const float* numerators, const float* pairs, size_t terms) {
  double sum = 0;
  for (size_t k = 0; k < terms; ++k) {
    sum -= 2 * double{u[k]} * double{numerators[k]};
    for (size_t l = k; l < terms; ++l, ++pairs)
      sum += (l == k ? 1 : 2) * double{*pairs} * double{u[k]} * double{u[l]};
  }
  return sum;
}

std::vector<double> columnSums(const PaddedRows<float>& columns) {
  std::vector<double> sums(columns.columns());
  for (size_t i = 0; i < columns.rows(); ++i)
    for (size_t k = 0; k < sums.size(); ++k) sums[k] += double{columns.row(i)[k]};
  return sums;
}

std::vector<double> columnSquares(const PaddedRows<float>& columns) {
  std::vector<double> squares(columns.columns());
  for (size_t i = 0; i < columns.rows(); ++i)
    for (size_t k = 0; k < squares.size(); ++k)
      squares[k] += double{columns.row(i)[k]} * double{columns.row(i)[k]};
  return squares;
}

PaddedRows<float> columnsOf(const PaddedRows<float>& from, const std::vector<size_t>& columns) {
  PaddedRows<float> result(from.rows(), columns.size());
  for (size_t i = 0; i < from.rows(); ++i)
    for (size_t k = 0; k < columns.size(); ++k) result.row(i)[k] = from.row(i)[columns[k]];
  return result;
}

class Updates {
public:
  Updates(ArrangedMatrix matrix, size_t terms, uint64_t seed) : sums_(std::move(matrix)) {
    std::mt19937_64 random(seed);
    factors.surface = randomFactors(sums_.rows(), terms, random);
    factors.view = randomFactors(sums_.planes() * sums_.stride(), terms, random);
    // Products of the start have the mean of the matrix.
    const double mean = std::accumulate(sums_.rowSums().begin(), sums_.rowSums().end(), 0.0) /
                        static_cast<double>(sums_.rows() * sums_.planes() * sums_.cells() * terms);
    for (size_t c = 0; c < sums_.planes(); ++c)
      for (size_t n = 0; n < sums_.stride(); ++n)
        for (size_t k = 0; k < terms; ++k) {
          float& v = factors.view.row(c * sums_.stride() + n)[k];
          v = n < sums_.cells() ? v * static_cast<float>(mean) : 0;
        }
  }

  // [Chen 2002, Appendix: U]
  void updateSurface() {
    const PaddedRows<float> numerators = sums_.alongView(factors.view);
    const PaddedRows<float> pairs = sums_.viewPairs(factors.view, false);
    for (size_t i = 0; i < sums_.rows(); ++i)
      update(factors.surface.row(i), numerators.row(i), pairs.row(pairs.rows() > 1 ? i : 0), terms());
  }

  // [Chen 2002, Appendix: V]; returns the weighted squared error.
  double updateView() {
    const PaddedRows<float> numerators = sums_.alongSurface(factors.surface);
    const PaddedRows<float> pairs = sums_.surfacePairs(factors.surface, {});
    double squares = sums_.squares();
    for (size_t c = 0; c < sums_.planes(); ++c)
      for (size_t n = 0; n < sums_.cells(); ++n) {
        const size_t place = c * sums_.stride() + n;
        const float* const pairsOfCell = pairs.row(pairs.rows() > 1 ? n : 0);
        update(factors.view.row(place), numerators.row(place), pairsOfCell, terms());
        squares += errorOf(factors.view.row(place), numerators.row(place), pairsOfCell, terms());
      }
    return std::max(0.0, squares);
  }

  // Columns of U sum to 1  [Chen 2002, Appendix]; V takes over the sum.
  void normalise() {
    const std::vector<double> sums = columnSums(factors.surface);
    scale(factors.surface, sums, true);
    scale(factors.view, sums, false);
  }

  size_t terms() const { return factors.surface.columns(); }

  PlainFactors factors;

private:
  static void scale(PaddedRows<float>& columns, const std::vector<double>& sums, bool isDivided) {
    for (size_t i = 0; i < columns.rows(); ++i)
      for (size_t k = 0; k < sums.size(); ++k)
        if (sums[k] > 0)
          columns.row(i)[k] =
              static_cast<float>(isDivided ? columns.row(i)[k] / sums[k] : columns.row(i)[k] * sums[k]);
  }

  WeightedSums sums_;
};

} // namespace

PlainFactors nonnegativeFactors(ArrangedMatrix matrix, const FitOptions& options, uint64_t seed,
                                const Progress& progress) {
  Updates updates(std::move(matrix), options.terms, seed);
  double before = std::numeric_limits<double>::infinity();
  for (size_t iteration = 0; iteration < options.mostIterations; ++iteration) {
    progress.checkpoint();
    updates.updateSurface();
    const double rms = std::sqrt(updates.updateView());
    updates.normalise();
    if (before - rms < options.convergence * before) break;
    before = rms;
  }
  PlainFactors& factors = updates.factors;
  const std::vector<double> u = columnSquares(factors.surface), v = columnSquares(factors.view);
  std::vector<size_t> order;
  for (size_t k = 0; k < u.size(); ++k)
    if (u[k] * v[k] > 0) order.push_back(k);
  std::ranges::stable_sort(order, [&](size_t a, size_t b) { return u[a] * v[a] > u[b] * v[b]; });
  return {columnsOf(factors.surface, order), columnsOf(factors.view, order), {}};
}

} // namespace surflect::lfm
