#include "render/lightfield/lfm/factorization.h"

#include "render/lightfield/lfm/factors.h"
#include "render/lightfield/lfm/nmf.h"
#include "render/lightfield/lfm/pca.h"
#include "surfel/base/error.h"

#include <Eigen/Core>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<uint32_t> others(const std::vector<uint32_t>& some, size_t count) {
  std::vector<uint32_t> rest;
  for (size_t i = 0, next = 0; i < count; ++i)
    if (next < some.size() && some[next] == i)
      ++next;
    else
      rest.push_back(static_cast<uint32_t>(i));
  return rest;
}

// Pseudoinverse of known factors [places][terms]: times values at these places, it is the least squares fit.
MatrixXd pseudoInverse(const MatrixXd& known) {
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
  decomposition.setThreshold(1e-5); // smaller pivots, as a share of the largest, are rounding error
  return decomposition.compute(known).pseudoInverse();
}

} // namespace

void projectUnobserved(const LightFieldMatrix& matrix, const Observed& observed, bool isPositive,
                       Factors& factors) {
  const std::vector<uint32_t> samples = others(observed.samples, matrix.samples);
  const std::vector<uint32_t> cells = others(observed.cells, matrix.cells);
  const size_t channels = matrix.channels;
  const auto value = [&](size_t sample, size_t cell, size_t c) {
    const float number = matrix.radiance[channels * (sample * matrix.cells + cell) + c];
    return std::isfinite(number) ? double{number} : 0;
  };
  const auto rest = [&](size_t sample, size_t cell, size_t c) {
    return value(sample, cell, c) - (factors.mean.empty() ? 0 : double{factors.mean[channels * sample + c]});
  };

  std::vector<uint32_t> all(matrix.cells);
  for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<uint32_t>(i);
  const std::vector<uint32_t>& seen = observed.cells.empty() ? all : observed.cells;
  for (const uint32_t sample : samples)
    for (size_t c = 0; c < channels && !factors.mean.empty() && !seen.empty(); ++c) {
      double sum = 0;
      for (const uint32_t cell : seen) sum += value(sample, cell, c);
      factors.mean[channels * sample + c] = static_cast<float>(sum / static_cast<double>(seen.size()));
    }
  if (factors.terms.empty()) return;

  const auto terms = static_cast<Eigen::Index>(factors.terms.size());
  const auto signedOf = [&](double factor) {
    return static_cast<float>(isPositive ? std::max(0.0, factor) : factor);
  };
  if (!samples.empty()) {
    MatrixXd known(channels * observed.cells.size(), terms);
    for (Eigen::Index i = 0; i < known.rows(); ++i)
      for (Eigen::Index k = 0; k < terms; ++k)
        known(i, k) = double{factors.terms[k].view[channels * observed.cells[i / channels] + i % channels]};
    const MatrixXd inverse = pseudoInverse(known);
    for (const uint32_t sample : samples) {
      VectorXd values(known.rows());
      for (Eigen::Index i = 0; i < values.size(); ++i)
        values[i] = rest(sample, observed.cells[i / channels], i % channels);
      const VectorXd u = inverse * values;
      for (Eigen::Index k = 0; k < terms; ++k) factors.terms[k].surface[sample] = signedOf(u[k]);
    }
  }
  if (!cells.empty()) {
    MatrixXd known(observed.samples.size(), terms);
    for (Eigen::Index i = 0; i < known.rows(); ++i)
      for (Eigen::Index k = 0; k < terms; ++k)
        known(i, k) = double{factors.terms[k].surface[observed.samples[i]]};
    const MatrixXd inverse = pseudoInverse(known);
    for (const uint32_t cell : cells)
      for (size_t c = 0; c < channels; ++c) {
        VectorXd values(known.rows());
        for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = rest(observed.samples[i], cell, c);
        const VectorXd v = inverse * values;
        for (Eigen::Index k = 0; k < terms; ++k) factors.terms[k].view[channels * cell + c] = signedOf(v[k]);
      }
  }
}

namespace {

// Divides the scale of each term between its maps so that their largest absolute values are equal.
// [Chen 2002, Appendix]: alpha = sqrt(max_u lambda / max_v), u <- lambda u / alpha, v <- alpha v; here
// lambda is in U already.
void balance(PlainFactors& factors) {
  const auto largest = [](const PaddedRows<float>& columns, size_t k) {
    float most = 0;
    for (size_t i = 0; i < columns.rows(); ++i) most = std::max(most, std::abs(columns.row(i)[k]));
    return most;
  };
  for (size_t k = 0; k < factors.terms(); ++k) {
    const float maxU = largest(factors.surface, k), maxV = largest(factors.view, k);
    if (!(maxU > 0) || !(maxV > 0)) continue;
    const float alpha = std::sqrt(maxU / maxV);
    for (size_t i = 0; i < factors.surface.rows(); ++i) factors.surface.row(i)[k] /= alpha;
    for (size_t i = 0; i < factors.view.rows(); ++i) factors.view.row(i)[k] *= alpha;
  }
}

// Makes the sign of a term definite: the first of the largest absolute values of V is positive.
void orient(PlainFactors& factors) {
  for (size_t k = 0; k < factors.terms(); ++k) {
    float extreme = 0;
    for (size_t i = 0; i < factors.view.rows(); ++i)
      if (std::abs(factors.view.row(i)[k]) > std::abs(extreme)) extreme = factors.view.row(i)[k];
    if (extreme >= 0) continue;
    for (size_t i = 0; i < factors.view.rows(); ++i) factors.view.row(i)[k] = -factors.view.row(i)[k];
    for (size_t i = 0; i < factors.surface.rows(); ++i)
      factors.surface.row(i)[k] = -factors.surface.row(i)[k];
  }
}

PlainFactors fitted(ArrangedMatrix matrix, size_t terms, const FactorizationOptions& options,
                    const Progress& progress) {
  const FitOptions fit{terms, options.mostIterations, options.convergence};
  if (options.method == Factorization::nmf)
    return nonnegativeFactors(std::move(matrix), fit, options.seed, progress);
  return matrix.weights ? weightedComponents(std::move(matrix), fit, progress)
                        : principalComponents(std::move(matrix), terms);
}

// Maps of all samples and cells; 0 where nothing was observed.
Factors assembled(const PlainFactors& from, const LightFieldMatrix& matrix, const Observed& observed) {
  const size_t channels = matrix.channels, stride = from.view.rows() / channels;
  Factors to{matrix.samples, matrix.cells, {}, {}, channels};
  for (size_t k = 0; k < from.terms(); ++k) {
    FactorTerm& term = to.terms.emplace_back();
    term.surface.assign(to.samples, 0);
    term.view.assign(channels * to.cells, 0);
    for (size_t row = 0; row < observed.samples.size(); ++row)
      term.surface[observed.samples[row]] = from.surface.row(row)[k];
    for (size_t n = 0; n < observed.cells.size(); ++n)
      for (size_t c = 0; c < channels; ++c)
        term.view[channels * observed.cells[n] + c] = from.view.row(c * stride + n)[k];
  }
  if (!from.mean.empty()) to.mean.assign(channels * to.samples, 0);
  for (size_t row = 0; row < observed.samples.size() && !to.mean.empty(); ++row)
    std::copy_n(&from.mean[channels * row], channels, &to.mean[channels * observed.samples[row]]);
  return to;
}

// Factors of the observed samples and cells.
Factors factorsOf(const LightFieldMatrix& matrix, const Observed& observed,
                  const FactorizationOptions& options, const Progress& progress) {
  const size_t fewest = options.method == Factorization::nmf ? std::min<size_t>(1, options.terms) : 0;
  ArrangedMatrix values = arranged(matrix, observed);
  for (size_t terms = options.tolerance > 0 ? fewest : options.terms;; ++terms) {
    const bool isLargest = terms == options.terms;
    PlainFactors plain = fitted(isLargest ? std::move(values) : values.copy(), terms, options, progress);
    const bool isLast = isLargest || plain.terms() < terms; // there are no more
    orient(plain);
    balance(plain);
    Factors factors = assembled(plain, matrix, observed);
    if (isLast || errorOf(factors, terms, matrix).rms() <= options.tolerance) return factors;
  }
}

void requireNonnegative(const LightFieldMatrix& matrix) {
  for (size_t i = 0; i < matrix.radiance.size(); ++i)
    if (matrix.radiance[i] < 0)
      throw Error::mismatch("a number >= 0", numberText(matrix.radiance[i]))
          .at("radiance[" + std::to_string(i) + "]");
}

} // namespace

Factors factorized(const LightFieldMatrix& matrix, const FactorizationOptions& options,
                   const Progress& progress) {
  const Observed observed = observedOf(matrix, options.leastWeight);
  const bool isPositive = options.method == Factorization::nmf;
  if (isPositive) requireNonnegative(matrix);
  Factors result{matrix.samples, matrix.cells, {}, {}, matrix.channels};
  if (!observed.samples.empty())
    result = factorsOf(matrix, observed, options, progress);
  else if (!isPositive)
    result.mean.assign(matrix.channels * matrix.samples, 0);
  projectUnobserved(matrix, observed, isPositive, result);
  return result;
}

} // namespace surflect::lfm
