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
  return sum * static_cast<double>(matrix.planes);
}

size_t partsOf(ColorLayout layout) { return layout == ColorLayout::rgb ? 3 : 1; }
size_t rowsOfSample(ColorLayout layout) { return layout == ColorLayout::scalarView ? 3 : 1; }

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

// Factors of all parts of a layout's matrix.
class Parts {
public:
  Parts(const LightFieldMatrix& matrix, const Observed& observed, const FactorizationOptions& options,
        const Progress& progress)
      : options_(options), progress_(progress), isUniform_(observed.isUniform) {
    for (size_t part = 0; part < partsOf(options.layout); ++part) {
      matrices_.push_back(arranged(matrix, observed, options.layout, part));
      weights_ += weightsOf(matrices_.back());
    }
  }

  std::vector<PlainFactors> factorized(size_t& terms) {
    if (options_.method == FactorMethod::pca) return components(terms);
    size_t count = options_.tolerance > 0 ? std::min<size_t>(1, options_.terms) : options_.terms;
    for (;; ++count) {
      std::vector<PlainFactors> factors;
      for (ArrangedMatrix& matrix : matrices_)
        factors.push_back(
            nonnegativeFactors(taken(matrix, options_.tolerance == 0), fit(count), options_.seed, progress_));
      terms = count;
      if (options_.tolerance == 0 || count >= options_.terms || fewestTerms(factors) <= count) return factors;
    }
  }

private:
  FitOptions fit(size_t terms) const { return {terms, options_.mostIterations, options_.convergence}; }
  double tolerated() const { return options_.tolerance * options_.tolerance * weights_; }

  // A matrix, or a copy where it is needed again.
  ArrangedMatrix taken(ArrangedMatrix& matrix, bool isLast) {
    return isLast ? std::move(matrix) : matrix.copy();
  }

  std::vector<PlainFactors> components(size_t& terms) {
    std::vector<PlainFactors> factors;
    terms = options_.terms;
    const bool isJudgedLater = options_.tolerance > 0 && (!isUniform_ || matrices_.size() > 1);
    for (ArrangedMatrix& each : matrices_) {
      ArrangedMatrix matrix = taken(each, !isJudgedLater);
      factors.push_back(isUniform_
                            ? principalComponents(std::move(matrix), terms, isJudgedLater ? 0 : tolerated())
                            : weightedComponents(std::move(matrix), fit(terms), progress_));
    }
    if (isJudgedLater) terms = std::min(terms, fewestTerms(factors));
    return factors;
  }

  // Fewest terms within the tolerance; more than there are if there are none.
  size_t fewestTerms(const std::vector<PlainFactors>& factors) const {
    std::vector<double> total;
    for (size_t part = 0; part < factors.size(); ++part) {
      const std::vector<double> errors = squaredErrors(matrices_[part], factors[part]);
      // A part with fewer terms keeps the error of its last.
      const double lastTotal = total.empty() ? 0 : total.back();
      if (total.size() < errors.size()) total.resize(errors.size(), lastTotal);
      for (size_t k = 0; k < total.size(); ++k) total[k] += errors[std::min(k, errors.size() - 1)];
    }
    return static_cast<size_t>(
        std::ranges::find_if(total, [&](double error) { return error <= tolerated(); }) - total.begin());
  }

  const FactorizationOptions& options_;
  const Progress& progress_;
  std::vector<ArrangedMatrix> matrices_;
  bool isUniform_;
  double weights_ = 0;
};

// Copies factors of one part to the maps of all samples and cells.
void assemble(const PlainFactors& from, size_t part, const Observed& observed, Factors& to) {
  const size_t us = surfaceChannels(to.layout), vs = viewChannels(to.layout);
  const size_t rowsOf = rowsOfSample(to.layout), planes = to.layout == ColorLayout::scalarSurface ? 3 : 1;
  const size_t stride = from.view.rows() / planes;
  for (size_t i = 0; i < observed.samples.size(); ++i)
    for (size_t r = 0; r < rowsOf; ++r) {
      const size_t row = i * rowsOf + r, sample = observed.samples[i];
      for (size_t k = 0; k < to.terms.size() && k < from.terms(); ++k)
        to.terms[k].surface[us * sample + (part + r) % us] = from.surface.row(row)[k];
      for (size_t c = 0; c < planes && !to.mean.empty(); ++c)
        to.mean[3 * sample + part + r + c] = from.mean[row * planes + c];
    }
  for (size_t n = 0; n < observed.cells.size(); ++n)
    for (size_t c = 0; c < planes; ++c)
      for (size_t k = 0; k < to.terms.size() && k < from.terms(); ++k)
        to.terms[k].view[vs * observed.cells[n] + (part + c) % vs] = from.view.row(c * stride + n)[k];
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
  const bool isPositive = options.method == FactorMethod::nmf;
  if (isPositive) requireNonnegative(matrix);
  Factors result{options.layout, matrix.samples, matrix.cells, {}, {}};
  if (!isPositive) result.mean.assign(3 * matrix.samples, 0);

  if (!observed.samples.empty()) {
    size_t terms = 0, found = 0;
    std::vector<PlainFactors> factors = Parts(matrix, observed, options, progress).factorized(terms);
    for (PlainFactors& part : factors) {
      orient(part);
      balance(part);
      found = std::max(found, part.terms());
    }
    result.terms.resize(std::min(terms, found));
    for (FactorTerm& term : result.terms) {
      term.surface.assign(surfaceChannels(options.layout) * matrix.samples, 0);
      term.view.assign(viewChannels(options.layout) * matrix.cells, 0);
    }
    for (size_t part = 0; part < factors.size(); ++part) assemble(factors[part], part, observed, result);
  }
  projectUnobserved(matrix, observed, isPositive, result);
  return result;
}

} // namespace surflect::lfm
