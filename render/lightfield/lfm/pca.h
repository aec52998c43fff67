// Principal components of an arranged matrix.
//
// [Halko 2011] Halko, Martinsson, Tropp: Finding Structure with Randomness.
#pragma once

#include "render/lightfield/lfm/factors.h"
#include "surfel/base/time.h"
#include "surfel/math/padded_rows.h"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace surflect::lfm {

// Sums over weighted entries of a matrix that alternating fits of U and V need, all as products of matrices.
// Fitting row u of U to given V: the normal equations are (sum_n w_n sum_c v_cn v_cn') u = sum_n w_n sum_c
// a_cn v_cn.

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

  // For each row: sum w a_c of each plane c; sum w.
  const std::vector<double>& rowSums() const { return rowSums_; }       // [rows][planes]
  const std::vector<double>& rowWeights() const { return rowWeights_; } // [rows]
  // Sum of w over rows.
  const std::vector<double>& cellWeights() const { return cellWeights_; } // [cells]

  // Residual of the factors, times its weights: w (a - mean - U V') [rows][planes x stride].
  PaddedRows<float> weightedRest(const PlainFactors& factors) const;

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
  std::vector<double> rowSums_, rowWeights_, cellWeights_;
  double squares_ = 0;
};

// Mean of each row in each plane, and the `terms` leading terms of the singular value decomposition of the
// rest; fewer if what is left is rounding error. Columns of V have unit length. All entries count equally:
// weights are ignored.
PlainFactors principalComponents(ArrangedMatrix matrix, size_t terms);

// Leading terms of the singular value decomposition of a matrix, without a mean: U has the lengths. There are
// fewer if these leave at most `negligible` of the sum of squares.
PlainFactors leadingTerms(const PaddedRows<float>& values, size_t terms, double negligible);

// Sum of weighted squares that is rounding error once the mean of the matrix is taken out.
double roundingOf(const ArrangedMatrix& matrix);

// Weighted mean of each row in each plane [rows][planes], which is subtracted from the observed values.
std::vector<float> takeMean(ArrangedMatrix& matrix);

// Principal components of a matrix of which not all entries were observed, or not equally well.
struct FitOptions {
  size_t terms = 1;
  size_t mostIterations = 1; // after each term that is added
  double convergence = 0; // iteration ends once the product of all RMS errors falls by less than this share
};

// Mean and `terms` terms with small weighted squared errors, for the first k terms of each k. There are none
// if the matrix is its mean. The matrix must have weights.
//
// With such weights the best k terms are not the first k of more. Terms are added one after another: the
// leading term of what is left, then all are fitted by alternating least squares of the errors of all k.
// Columns of V have unit length, weighted by the mean weights of cells.
//
// A ridge keeps factors of rows and cells with few observations near 0: that of a normal prior with the mean
// square that a factor has so far, weighted by kPriorShare. Factors are finite if the values are.
PlainFactors weightedComponents(ArrangedMatrix matrix, const FitOptions& options, const Progress& progress);

inline constexpr double kPriorShare = 0.1;

} // namespace surflect::lfm
