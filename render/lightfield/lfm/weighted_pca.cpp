#include "render/lightfield/lfm/weighted_pca.h"

#include "render/lightfield/lfm/pca.h"
#include "render/lightfield/lfm/weighted_sums.h"
#include "surfel/math/padded_products.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Share of the trace that is added to the diagonal of sums of floats, above their rounding error: it keeps
// the equations positive definite where fewer cells were observed than there are terms.
constexpr double kRidge = 1e-6;

VectorXd vectorAt(const float* numbers, size_t terms) {
  return Eigen::Map<const Eigen::VectorXf>(numbers, static_cast<Eigen::Index>(terms)).cast<double>();
}

void store(const VectorXd& vector, float* to) {
  for (Eigen::Index k = 0; k < vector.size(); ++k) to[k] = static_cast<float>(vector[k]);
}

MatrixXd gramOf(const PaddedRows<float>& columns) {
  MatrixXd gram = MatrixXd::Zero(columns.columns(), columns.columns());
  for (size_t i = 0; i < columns.rows(); ++i) {
    const VectorXd row = vectorAt(columns.row(i), columns.columns());
    gram.noalias() += row * row.transpose();
  }
  return gram;
}

PaddedRows<float> transformed(const PaddedRows<float>& columns, const MatrixXd& by) {
  PaddedRows<float> matrix(by.rows(), by.cols());
  for (size_t i = 0; i < matrix.rows(); ++i)
    for (size_t k = 0; k < matrix.columns(); ++k) matrix.row(i)[k] = static_cast<float>(by(i, k));
  return product(columns, matrix);
}

class Fit {
public:
  // The mean of the matrix has been taken out.
  Fit(ArrangedMatrix matrix, size_t terms, double negligible);

  size_t terms() const { return factors_.terms(); }
  double squaredError() const { return squaredError_; } // weighted; after fitRows()

  // Fits U and the mean of each row to V.
  void fitRows();
  // Fits V to U and the mean.
  void fitCells();
  // Makes columns of V orthonormal and those of U orthogonal, the longest first, and moves the mean of V over
  // cells to the mean of the rows. The product stays, u (v - m)' + u m' = u v', since all rows share m: it is
  // the unweighted mean.
  void orthogonalise();

  PlainFactors factors() && { return std::move(factors_); }

private:
  // Precision of the priors times the variance of an observation.
  double priorOfSurface(size_t k) const {
    return priorOfCell() * static_cast<double>(sums_.rows()) / (lengths_[k] * static_cast<double>(numbers()));
  }
  double priorOfCell() const {
    return kPriorShare * std::max(squaredError_, negligible_) / entries_ * static_cast<double>(numbers());
  }
  size_t numbers() const { return sums_.planes() * sums_.cells(); } // of a column of V

  PlainFactors factors_;
  std::vector<double> lengths_; // squared, of the columns of U
  double squaredError_ = 0, entries_ = 0;
  double negligible_; // sum of squares that is rounding error
  WeightedSums sums_;
};

Fit::Fit(ArrangedMatrix matrix, size_t terms, double negligible)
    : negligible_(negligible), sums_(std::move(matrix)) {
  factors_ = leadingTerms(sums_.weightedValues(), terms, negligible_);
  factors_.mean.assign(sums_.planes() * sums_.rows(), 0);
  for (const double weights : sums_.rowWeights()) entries_ += weights * static_cast<double>(sums_.planes());
  const MatrixXd gram = gramOf(factors_.surface);
  for (size_t k = 0; k < factors_.terms(); ++k) lengths_.push_back(gram(k, k));
  squaredError_ = std::max(0.0, sums_.squares() - gram.trace());
}

void Fit::fitRows() {
  const size_t count = terms();
  const PaddedRows<float> along = sums_.alongView(factors_.view);
  const PaddedRows<float> pairs = sums_.viewPairs(factors_.view, true);
  VectorXd priors(count);
  for (size_t k = 0; k < count; ++k) priors[k] = priorOfSurface(k);
  double squares = sums_.squares();
  for (size_t row = 0; row < sums_.rows(); ++row) {
    const MatrixXd gram = unpacked(pairs.row(row), count);
    const VectorXd right = vectorAt(along.row(row), count);
    const double weight = sums_.rowWeights()[row];
    // The mean m_c of plane c is weight m_c = b_c - p_c u, which leaves equations for u alone.
    MatrixXd reduced = gram;
    VectorXd reducedRight = right;
    const auto sumOfView = [&](size_t c) {
      return vectorAt(pairs.row(row) + pairsOf(count) + c * count, count);
    };
    const double* const b = sums_.rowSums().data() + row * sums_.planes();
    for (size_t c = 0; c < sums_.planes(); ++c) {
      const VectorXd p = sumOfView(c);
      reduced.noalias() -= p * p.transpose() / weight;
      reducedRight -= p * (b[c] / weight);
    }
    reduced.diagonal() += priors;
    reduced.diagonal().array() += kRidge * gram.trace();
    const VectorXd u = reduced.ldlt().solve(reducedRight);
    store(u, factors_.surface.row(row));

    squares += u.dot(gram * u) - 2 * u.dot(right);
    for (size_t c = 0; c < sums_.planes(); ++c) {
      const double along_c = sumOfView(c).dot(u), mean = (b[c] - along_c) / weight;
      factors_.mean[row * sums_.planes() + c] = static_cast<float>(mean);
      squares += mean * (2 * along_c - 2 * b[c] + weight * mean);
    }
  }
  squaredError_ = std::max(0.0, squares);
}

void Fit::fitCells() {
  const size_t count = terms();
  const PaddedRows<float> along = sums_.alongSurface(factors_.surface);
  const PaddedRows<float> pairs = sums_.surfacePairs(factors_.surface, factors_.mean);
  for (size_t n = 0; n < sums_.cells(); ++n) {
    MatrixXd gram = unpacked(pairs.row(n), count);
    gram.diagonal().array() += priorOfCell() + kRidge * gram.trace();
    const Eigen::LDLT<MatrixXd> solver(gram);
    for (size_t c = 0; c < sums_.planes(); ++c) {
      const size_t place = c * sums_.stride() + n;
      const VectorXd right =
          vectorAt(along.row(place), count) - vectorAt(pairs.row(n) + pairsOf(count) + c * count, count);
      store(solver.solve(right), factors_.view.row(place));
    }
  }
}

void Fit::orthogonalise() {
  const size_t count = terms();
  for (size_t c = 0; c < sums_.planes(); ++c) {
    VectorXd mean = VectorXd::Zero(count);
    for (size_t n = 0; n < sums_.cells(); ++n)
      mean += vectorAt(factors_.view.row(c * sums_.stride() + n), count);
    mean /= static_cast<double>(sums_.cells());
    for (size_t n = 0; n < sums_.cells(); ++n)
      for (size_t k = 0; k < count; ++k)
        factors_.view.row(c * sums_.stride() + n)[k] -= static_cast<float>(mean[k]);
    for (size_t row = 0; row < sums_.rows(); ++row)
      factors_.mean[row * sums_.planes() + c] +=
          static_cast<float>(vectorAt(factors_.surface.row(row), count).dot(mean));
  }
  // V = W S, where W is orthonormal; U S' = Q L R' gives U V' = (Q L) (W R)'.
  const Eigen::SelfAdjointEigenSolver<MatrixXd> ofView(gramOf(factors_.view));
  const VectorXd roots = ofView.eigenvalues().cwiseMax(0).cwiseSqrt();
  const VectorXd inverse = roots.unaryExpr(
      [&](double root) { return root > 1e-6 * roots.maxCoeff() && root > 0 ? 1 / root : 0.0; });
  const MatrixXd spread = ofView.eigenvectors() * roots.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> ofProduct(spread.transpose() * gramOf(factors_.surface) *
                                                          spread);
  const MatrixXd turn = ofProduct.eigenvectors().rowwise().reverse();
  factors_.surface = transformed(factors_.surface, spread * turn);
  factors_.view = transformed(factors_.view, ofView.eigenvectors() * inverse.asDiagonal() * turn);
  for (size_t k = 0; k < count; ++k)
    lengths_[k] = std::max(ofProduct.eigenvalues()[count - 1 - k], negligible_);
}

} // namespace

PlainFactors weightedComponents(ArrangedMatrix matrix, const FitOptions& options, const Progress& progress) {
  const double negligible = roundingOf(matrix);
  const std::vector<float> mean = takeMean(matrix);
  Fit fit(std::move(matrix), options.terms, negligible);
  double before = std::numeric_limits<double>::infinity();
  for (size_t iteration = 0; fit.terms() > 0; ++iteration) {
    progress.checkpoint();
    fit.fitRows();
    const double rms = std::sqrt(fit.squaredError());
    fit.orthogonalise();
    if (iteration >= options.mostIterations || before - rms < options.convergence * before) break;
    before = rms;
    fit.fitCells();
  }
  PlainFactors factors = std::move(fit).factors();
  for (size_t i = 0; i < mean.size(); ++i) factors.mean[i] += mean[i];
  return factors;
}

} // namespace surflect::lfm
