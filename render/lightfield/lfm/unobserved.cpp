#include "render/lightfield/lfm/unobserved.h"

#include <Eigen/Core>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <cstdint>
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

} // namespace surflect::lfm
