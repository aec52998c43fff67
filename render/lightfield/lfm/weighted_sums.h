// Sums over weighted entries of a matrix that alternating fits of U and V need, all as products of matrices.
//
// Fitting row u of U to given V: the normal equations are (sum_n w_n sum_c v_cn v_cn') u = sum_n w_n sum_c
// a_cn v_cn.
#pragma once

#include "render/lightfield/lfm/arranged_matrix.h"
#include "surfel/math/padded_rows.h"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace surflect::lfm {

// Number of products u_k u_l, k <= l, of a row of factors.
size_t pairsOf(size_t terms);
// The symmetric matrix of such products.
Eigen::MatrixXd unpacked(const float* pairs, size_t terms);

class WeightedSums {
public:
  explicit WeightedSums(ArrangedMatrix matrix);

  size_t rows() const { return values_.rows(); }
  size_t planes() const { return planes_; }
  size_t stride() const { return stride_; }
  size_t cells() const { return cells_; }
  double squares() const { return squares_; } // sum w a^2
  const PaddedRows<float>& weightedValues() const { return values_; }

  // For each row: sum w a_c of each plane c; sum w.
  const std::vector<double>& rowSums() const { return rowSums_; }       // [rows][planes]
  const std::vector<double>& rowWeights() const { return rowWeights_; } // [rows]

  // sum over cells and planes of w a v: [rows][terms]; sum over rows of w a u: [planes x stride][terms].
  PaddedRows<float> alongView(const PaddedRows<float>& view) const;
  PaddedRows<float> alongSurface(const PaddedRows<float>& surface) const;

  // For each row: pairs of v, summed with w over cells and planes; then the sum of w v_c for each plane c.
  // One row stands for all if all weights are 1.
  PaddedRows<float> viewPairs(const PaddedRows<float>& view, bool withSums) const;
  // For each cell: pairs of u, summed with w over rows; then the sum of w mean_c u for each plane c, unless
  // `mean` is empty. One row stands for all if all weights are 1.
  PaddedRows<float> surfacePairs(const PaddedRows<float>& surface, const std::vector<float>& mean) const;

private:
  size_t planes_, stride_, cells_;
  PaddedRows<float> values_;  // w a
  PaddedRows<float> weights_; // none if all are 1
  std::vector<double> rowSums_, rowWeights_;
  double squares_ = 0;
};

} // namespace surflect::lfm
