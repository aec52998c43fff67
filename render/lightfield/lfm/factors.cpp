#include "render/lightfield/lfm/factors.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::lfm {

namespace {

// mean + sum_k u_k v_k of a sample in all cells and channels  [Chen et al. 2002, Eq. 5].
void productOf(const Factors& factors, size_t terms, size_t sample, std::span<float> row) {
  for (size_t i = 0; i < row.size(); ++i)
    row[i] = factors.mean.empty() ? 0 : factors.mean[factors.channels * sample + i % factors.channels];
  for (size_t k = 0; k < std::min(terms, factors.terms.size()); ++k) {
    const float u = factors.terms[k].surface[sample];
    const std::vector<float>& v = factors.terms[k].view;
    for (size_t i = 0; i < row.size(); ++i) row[i] += u * v[i];
  }
}

} // namespace

std::vector<float> product(const Factors& factors, size_t terms) {
  const size_t width = factors.channels * factors.cells;
  std::vector<float> radiance(factors.samples * width);
  for (size_t sample = 0; sample < factors.samples; ++sample)
    productOf(factors, terms, sample, std::span(radiance).subspan(sample * width, width));
  return radiance;
}

double FactorError::rms() const { return weight > 0 ? std::sqrt(squares / weight) : 0; }

FactorError errorOf(const Factors& factors, size_t terms, const LightFieldMatrix& matrix) {
  assert(factors.channels == matrix.channels);
  const size_t channels = factors.channels;
  FactorError error;
  std::vector<float> row(channels * factors.cells);
  for (size_t sample = 0; sample < factors.samples; ++sample) {
    productOf(factors, terms, sample, row);
    for (size_t cell = 0; cell < factors.cells; ++cell) {
      const size_t entry = sample * factors.cells + cell;
      const double weight = matrix.weights.empty() ? 1 : matrix.weights[entry];
      double squares = 0;
      for (size_t c = 0; c < channels; ++c) {
        const double difference =
            double{matrix.radiance[channels * entry + c]} - double{row[channels * cell + c]};
        squares += difference * difference;
      }
      if (!(weight > 0) || !std::isfinite(squares)) continue;
      error.squares += weight * squares;
      error.weight += static_cast<double>(channels) * weight;
    }
  }
  return error;
}

} // namespace surflect::lfm
