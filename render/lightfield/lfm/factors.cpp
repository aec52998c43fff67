#include "render/lightfield/lfm/factors.h"

#include "surfel/base/error.h"
#include "surfel/math/padded_rows.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

namespace surflect::lfm {

namespace {

// mean + sum_k u_k v_k of a sample in all cells and channels  [Chen 2002, Eq. 5].
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
      const double weight = double{matrix.weights.empty() ? 1 : matrix.weights[entry]} *
                            double{matrix.cellWeights.empty() ? 1 : matrix.cellWeights[cell]};
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

namespace {

size_t roundedUp(size_t count) { return (count + 7) / 8 * 8; }

void requireFitting(const LightFieldMatrix& matrix) {
  const size_t entries = matrix.samples * matrix.cells;
  if (matrix.radiance.size() != matrix.channels * entries)
    throw Error::mismatch(std::to_string(matrix.channels * entries) + " numbers",
                          std::to_string(matrix.radiance.size()))
        .at("radiance");
  if (!matrix.weights.empty() && matrix.weights.size() != entries)
    throw Error::mismatch(std::to_string(entries) + " numbers", std::to_string(matrix.weights.size()))
        .at("weights");
  if (!matrix.cellWeights.empty() && matrix.cellWeights.size() != matrix.cells)
    throw Error::mismatch(std::to_string(matrix.cells) + " numbers",
                          std::to_string(matrix.cellWeights.size()))
        .at("cellWeights");
  const auto requireWeights = [](std::span<const float> weights, const char* field) {
    for (size_t i = 0; i < weights.size(); ++i)
      if (!(weights[i] >= 0) || !std::isfinite(weights[i]))
        throw Error::mismatch("a finite number >= 0", numberText(weights[i]))
            .at(field + ("[" + std::to_string(i) + "]"));
  };
  requireWeights(matrix.weights, "weights");
  requireWeights(matrix.cellWeights, "cellWeights");
}

// Weight of an entry in the fit.
float weightOf(const LightFieldMatrix& matrix, size_t entry, float leastWeight) {
  const auto values = matrix.radiance.subspan(matrix.channels * entry, matrix.channels);
  if (!std::ranges::all_of(values, [](float value) { return std::isfinite(value); })) return 0;
  const float weight = matrix.weights.empty() ? 1 : std::max(matrix.weights[entry], leastWeight);
  return matrix.cellWeights.empty() ? weight : weight * matrix.cellWeights[entry % matrix.cells];
}

// Weight as a share of the largest.
float shareOf(const LightFieldMatrix& matrix, const Observed& observed, size_t sample, size_t cell) {
  const float share =
      weightOf(matrix, sample * matrix.cells + cell, observed.leastWeight) / observed.largestWeight;
  return share < kNegligibleWeight ? 0 : share;
}

} // namespace

Observed observedOf(const LightFieldMatrix& matrix, float leastWeight) {
  requireFitting(matrix);
  Observed observed{{}, {}, leastWeight, 0};
  for (size_t entry = 0; entry < matrix.samples * matrix.cells; ++entry)
    observed.largestWeight = std::max(observed.largestWeight, weightOf(matrix, entry, leastWeight));
  if (observed.largestWeight == 0) return observed;

  std::vector<char> isCellObserved(matrix.cells);
  for (size_t sample = 0; sample < matrix.samples; ++sample) {
    bool isObserved = false;
    for (size_t cell = 0; cell < matrix.cells; ++cell)
      if (shareOf(matrix, observed, sample, cell) > 0) {
        isObserved = true;
        isCellObserved[cell] = 1;
      }
    if (isObserved) observed.samples.push_back(static_cast<uint32_t>(sample));
  }
  for (size_t cell = 0; cell < matrix.cells; ++cell)
    if (isCellObserved[cell]) observed.cells.push_back(static_cast<uint32_t>(cell));
  return observed;
}

ArrangedMatrix ArrangedMatrix::copy() const {
  ArrangedMatrix result;
  result.planes = planes;
  result.stride = stride;
  result.cells = cells;
  result.values = copied(values);
  if (weights) result.weights = copied(*weights);
  return result;
}

ArrangedMatrix arranged(const LightFieldMatrix& matrix, const Observed& observed) {
  ArrangedMatrix result;
  result.planes = matrix.channels;
  result.cells = observed.cells.size();
  result.stride = roundedUp(result.cells);
  result.values = PaddedRows<float>(observed.samples.size(), result.planes * result.stride);
  result.weights.emplace(result.rows(), result.cells);
  bool isUniform = true;
  for (size_t row = 0; row < result.rows(); ++row) {
    const uint32_t sample = observed.samples[row];
    std::fill_n(result.values.row(row), result.values.stride(), 0.0f);
    for (size_t n = 0; n < result.cells; ++n) {
      const float weight = shareOf(matrix, observed, sample, observed.cells[n]);
      result.weights->row(row)[n] = weight;
      isUniform &= weight == 1;
      if (weight == 0) continue;
      const float* const from =
          matrix.radiance.data() + result.planes * (sample * matrix.cells + observed.cells[n]);
      for (size_t c = 0; c < result.planes; ++c) result.plane(row, c)[n] = from[c];
    }
  }
  if (isUniform) result.weights.reset();
  return result;
}

} // namespace surflect::lfm
