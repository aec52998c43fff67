#include "render/lightfield/lfm/factorization.h"

#include "render/lightfield/lfm/arranged_matrix.h"
#include "render/lightfield/lfm/nmf.h"
#include "render/lightfield/lfm/pca.h"
#include "render/lightfield/lfm/unobserved.h"
#include "render/lightfield/lfm/weighted_pca.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

// Weights of all entries, as an arranged matrix has them.
double weightsOf(const ArrangedMatrix& matrix) {
  double sum = 0;
  for (size_t row = 0; row < matrix.rows(); ++row)
    for (size_t n = 0; n < matrix.cells; ++n)
      sum += matrix.weights ? double{matrix.weights->row(row)[n]} : 1.0;
  return sum * static_cast<double>(kPlanes);
}

// Divides the scale of each term between its maps so that their largest absolute values are equal.
// [Chen et al. 2002, Appendix]: alpha = sqrt(max_u lambda / max_v), u <- lambda u / alpha, v <- alpha v; here
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
  if (options.method == Method::nmf)
    return nonnegativeFactors(std::move(matrix), fit, options.seed, progress);
  return matrix.weights ? weightedComponents(std::move(matrix), fit, progress)
                        : principalComponents(std::move(matrix), terms, 0);
}

// The fewest terms within the tolerance. Factors of all terms, if fewer are enough, have more.
PlainFactors fittedWithin(ArrangedMatrix matrix, size_t& terms, const FactorizationOptions& options,
                          const Progress& progress) {
  terms = options.terms;
  if (options.tolerance == 0) return fitted(std::move(matrix), terms, options, progress);
  const double tolerated = options.tolerance * options.tolerance * weightsOf(matrix);
  size_t count = options.method == Method::nmf ? std::min<size_t>(1, terms) : terms;
  for (;; ++count) {
    PlainFactors factors = fitted(matrix.copy(), count, options, progress);
    const std::vector<double> errors = squaredErrors(matrix, factors);
    const auto fewest = static_cast<size_t>(
        std::ranges::find_if(errors, [&](double error) { return error <= tolerated; }) - errors.begin());
    if (count < options.terms && fewest > count) continue;
    terms = std::min(count, fewest);
    return factors;
  }
}

// Copies factors to the maps of all samples and cells.
void assemble(const PlainFactors& from, const Observed& observed, Factors& to) {
  const size_t stride = from.view.rows() / kPlanes;
  for (size_t k = 0; k < to.terms.size(); ++k) {
    FactorTerm& term = to.terms[k];
    term.surface.assign(to.samples, 0);
    term.view.assign(kPlanes * to.cells, 0);
    for (size_t row = 0; row < observed.samples.size(); ++row)
      term.surface[observed.samples[row]] = from.surface.row(row)[k];
    for (size_t n = 0; n < observed.cells.size(); ++n)
      for (size_t c = 0; c < kPlanes; ++c)
        term.view[kPlanes * observed.cells[n] + c] = from.view.row(c * stride + n)[k];
  }
  for (size_t row = 0; row < observed.samples.size() && !to.mean.empty(); ++row)
    std::copy_n(&from.mean[kPlanes * row], kPlanes, &to.mean[kPlanes * observed.samples[row]]);
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
  const Observed observed = observedOf(matrix);
  const bool isPositive = options.method == Method::nmf;
  if (isPositive) requireNonnegative(matrix);
  Factors result{matrix.samples, matrix.cells, {}, {}};
  if (!isPositive) result.mean.assign(kPlanes * matrix.samples, 0);

  if (!observed.samples.empty()) {
    size_t terms = 0;
    PlainFactors factors = fittedWithin(arranged(matrix, observed), terms, options, progress);
    orient(factors);
    balance(factors);
    result.terms.resize(std::min(terms, factors.terms()));
    assemble(factors, observed, result);
  }
  projectUnobserved(matrix, observed, isPositive, result);
  return result;
}

} // namespace surflect::lfm
