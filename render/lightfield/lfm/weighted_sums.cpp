#include "render/lightfield/lfm/weighted_sums.h"

#include "surfel/math/padded_products.h"

#include <algorithm>
#include <utility>

namespace surflect::lfm {

namespace {

PaddedRows<float> filled(size_t rows, size_t columns, float value) {
  PaddedRows<float> matrix(rows, columns);
  for (size_t i = 0; i < rows; ++i) std::fill_n(matrix.row(i), columns, value);
  return matrix;
}

void addPairs(const float* factors, size_t terms, float* to) {
  for (size_t k = 0; k < terms; ++k)
    for (size_t l = k; l < terms; ++l) *to++ += factors[k] * factors[l];
}

} // namespace

size_t pairsOf(size_t terms) { return terms * (terms + 1) / 2; }

Eigen::MatrixXd unpacked(const float* pairs, size_t terms) {
  Eigen::MatrixXd matrix(terms, terms);
  for (size_t k = 0; k < terms; ++k)
    for (size_t l = k; l < terms; ++l) matrix(k, l) = matrix(l, k) = double{*pairs++};
  return matrix;
}

WeightedSums::WeightedSums(ArrangedMatrix matrix)
    : planes_(matrix.planes), stride_(matrix.stride), cells_(matrix.cells), values_(0, 0), weights_(0, 0) {
  for (size_t row = 0; row < matrix.rows(); ++row) {
    double weights = 0;
    for (size_t n = 0; n < cells_; ++n) weights += matrix.weights ? matrix.weights->row(row)[n] : 1;
    rowWeights_.push_back(weights);
    for (size_t c = 0; c < planes_; ++c) {
      double sum = 0, squares = 0;
      for (size_t n = 0; n < cells_; ++n) {
        float& value = matrix.plane(row, c)[n];
        const float weighted = value * (matrix.weights ? matrix.weights->row(row)[n] : 1.0f);
        sum += double{weighted};
        squares += double{weighted} * double{value};
        value = weighted;
      }
      rowSums_.push_back(sum);
      squares_ += squares;
    }
  }
  values_ = std::move(matrix.values);
  if (matrix.weights) weights_ = std::move(*matrix.weights);
}

PaddedRows<float> WeightedSums::alongView(const PaddedRows<float>& view) const {
  return product(values_, view);
}
PaddedRows<float> WeightedSums::alongSurface(const PaddedRows<float>& surface) const {
  return innerProducts(values_, surface);
}

PaddedRows<float> WeightedSums::viewPairs(const PaddedRows<float>& view, bool withSums) const {
  const size_t terms = view.columns(), pairs = pairsOf(terms);
  PaddedRows<float> ofCells = filled(cells_, pairs + (withSums ? planes_ * terms : 0), 0);
  for (size_t n = 0; n < cells_; ++n)
    for (size_t c = 0; c < planes_; ++c) {
      const float* const v = view.row(c * stride_ + n);
      addPairs(v, terms, ofCells.row(n));
      if (withSums) std::copy_n(v, terms, ofCells.row(n) + pairs + c * terms);
    }
  return weights_.rows() ? product(weights_, ofCells) : product(filled(1, cells_, 1), ofCells);
}

PaddedRows<float> WeightedSums::surfacePairs(const PaddedRows<float>& surface,
                                             const std::vector<float>& mean) const {
  const size_t terms = surface.columns(), pairs = pairsOf(terms);
  PaddedRows<float> ofRows = filled(rows(), pairs + (mean.empty() ? 0 : planes_ * terms), 0);
  for (size_t i = 0; i < rows(); ++i) {
    const float* const u = surface.row(i);
    addPairs(u, terms, ofRows.row(i));
    if (!mean.empty())
      for (size_t c = 0; c < planes_; ++c)
        for (size_t k = 0; k < terms; ++k)
          ofRows.row(i)[pairs + c * terms + k] = mean[i * planes_ + c] * u[k];
  }
  return weights_.rows() ? innerProducts(weights_, ofRows) : product(filled(1, rows(), 1), ofRows);
}

} // namespace surflect::lfm
