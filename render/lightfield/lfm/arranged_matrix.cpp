#include "render/lightfield/lfm/arranged_matrix.h"

#include "surfel/base/error.h"
#include "surfel/math/padded_products.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace surflect::lfm {

namespace {

size_t roundedUp(size_t count) { return (count + 7) / 8 * 8; }

void requireFitting(const LightFieldMatrix& matrix) {
  const size_t entries = matrix.samples * matrix.cells;
  if (matrix.radiance.size() != 3 * entries)
    throw Error::mismatch(std::to_string(3 * entries) + " numbers", std::to_string(matrix.radiance.size()))
        .at("radiance");
  if (!matrix.weights.empty() && matrix.weights.size() != entries)
    throw Error::mismatch(std::to_string(entries) + " numbers", std::to_string(matrix.weights.size()))
        .at("weights");
  for (size_t i = 0; i < matrix.weights.size(); ++i)
    if (!(matrix.weights[i] >= 0) || !std::isfinite(matrix.weights[i]))
      throw Error::mismatch("a finite number >= 0", numberText(matrix.weights[i]))
          .at("weights[" + std::to_string(i) + "]");
}

} // namespace

float weightOf(const LightFieldMatrix& matrix, size_t sample, size_t cell) {
  const size_t entry = sample * matrix.cells + cell;
  const float* const rgb = matrix.radiance.data() + 3 * entry;
  if (!std::isfinite(rgb[0]) || !std::isfinite(rgb[1]) || !std::isfinite(rgb[2])) return 0;
  return matrix.weights.empty() ? 1 : matrix.weights[entry];
}

Observed observedOf(const LightFieldMatrix& matrix) {
  requireFitting(matrix);
  Observed observed;
  std::vector<char> isCellObserved(matrix.cells);
  for (size_t sample = 0; sample < matrix.samples; ++sample) {
    bool isObserved = false;
    for (size_t cell = 0; cell < matrix.cells; ++cell) {
      const float weight = weightOf(matrix, sample, cell);
      if (weight == 0) continue;
      isObserved = true;
      isCellObserved[cell] = 1;
      observed.largestWeight = std::max(observed.largestWeight, weight);
    }
    if (isObserved) observed.samples.push_back(static_cast<uint32_t>(sample));
  }
  for (size_t cell = 0; cell < matrix.cells; ++cell)
    if (isCellObserved[cell]) observed.cells.push_back(static_cast<uint32_t>(cell));
  observed.isUniform = std::ranges::all_of(observed.samples, [&](uint32_t sample) {
    return std::ranges::all_of(observed.cells, [&](uint32_t cell) {
      return weightOf(matrix, sample, cell) == observed.largestWeight;
    });
  });
  return observed;
}

ArrangedMatrix ArrangedMatrix::copy() const {
  ArrangedMatrix result;
  result.stride = stride;
  result.cells = cells;
  result.values = copied(values);
  if (weights) result.weights = copied(*weights);
  return result;
}

ArrangedMatrix arranged(const LightFieldMatrix& matrix, const Observed& observed) {
  ArrangedMatrix result;
  result.cells = observed.cells.size();
  result.stride = roundedUp(result.cells);
  result.values = PaddedRows<float>(observed.samples.size(), kPlanes * result.stride);
  if (!observed.isUniform) result.weights.emplace(result.rows(), result.cells);

  for (size_t row = 0; row < result.rows(); ++row) {
    const uint32_t sample = observed.samples[row];
    std::fill_n(result.values.row(row), result.values.stride(), 0.0f);
    for (size_t n = 0; n < result.cells; ++n) {
      const float weight = weightOf(matrix, sample, observed.cells[n]) / observed.largestWeight;
      if (result.weights) result.weights->row(row)[n] = weight;
      if (weight == 0) continue;
      const float* const rgb = matrix.radiance.data() + 3 * (sample * matrix.cells + observed.cells[n]);
      for (size_t c = 0; c < kPlanes; ++c) result.plane(row, c)[n] = rgb[c];
    }
  }
  return result;
}

std::vector<double> squaredErrors(const ArrangedMatrix& matrix, const PlainFactors& factors) {
  std::vector<double> errors(factors.terms() + 1);
  std::vector<float> rest(matrix.stride);
  for (size_t row = 0; row < matrix.rows(); ++row)
    for (size_t c = 0; c < kPlanes; ++c) {
      const float mean = factors.mean.empty() ? 0 : factors.mean[row * kPlanes + c];
      for (size_t n = 0; n < matrix.cells; ++n) rest[n] = matrix.plane(row, c)[n] - mean;
      for (size_t k = 0; k < errors.size(); ++k) {
        if (k > 0)
          for (size_t n = 0; n < matrix.cells; ++n)
            rest[n] -= factors.surface.row(row)[k - 1] * factors.view.row(c * matrix.stride + n)[k - 1];
        double sum = 0;
        for (size_t n = 0; n < matrix.cells; ++n) {
          const double weight = matrix.weights ? matrix.weights->row(row)[n] : 1;
          sum += weight * double{rest[n]} * double{rest[n]};
        }
        errors[k] += sum;
      }
    }
  return errors;
}

} // namespace surflect::lfm
