#include "render/lightfield/lfm/pca.h"

#include "surfel/math/padded_rows.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <utility>
#include <vector>

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
    : planes_(matrix.planes), stride_(matrix.stride), cells_(matrix.cells), values_(0, 0), weights_(0, 0),
      cellWeights_(matrix.cells, 0) {
  for (size_t row = 0; row < matrix.rows(); ++row) {
    double weights = 0;
    for (size_t n = 0; n < cells_; ++n) {
      const double weight = matrix.weights ? matrix.weights->row(row)[n] : 1;
      weights += weight;
      cellWeights_[n] += weight;
    }
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

PaddedRows<float> WeightedSums::weightedRest(const PlainFactors& factors) const {
  PaddedRows<float> rest = copied(values_);
  const bool hasTerms = factors.terms() > 0;
  const PaddedRows<float> terms =
      hasTerms ? product(factors.surface, transposed(factors.view)) : PaddedRows<float>(0, 0);
  for (size_t row = 0; row < rows(); ++row)
    for (size_t c = 0; c < planes_; ++c)
      for (size_t n = 0; n < cells_; ++n) {
        const size_t place = c * stride_ + n;
        const float fitted = factors.mean[row * planes_ + c] + (hasTerms ? terms.row(row)[place] : 0);
        rest.row(row)[place] -= (weights_.rows() ? weights_.row(row)[n] : 1) * fitted;
      }
  return rest;
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

namespace {

// Rest of a matrix after its mean that counts as rounding error, as a share of its root mean square.
constexpr double kRounding = 1e-6;

float weightAt(const ArrangedMatrix& matrix, size_t row, size_t cell) {
  return matrix.weights ? matrix.weights->row(row)[cell] : 1.0f;
}

// Shorter terms than this share of the longest are rounding error.
constexpr double kShortest = 2e-6;
// Iteration ends once the residual |T' T v - sigma^2 v| of each term is below this share of the largest
// sigma^2.
constexpr double kResidual = 1e-6;
constexpr int kMostSteps = 40;
constexpr size_t kSpare = 8; // further columns, which speed up the iteration

using Eigen::MatrixXd;

MatrixXd inDouble(const PaddedRows<float>& m) {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>>(
             m.row(0), static_cast<Eigen::Index>(m.rows()), static_cast<Eigen::Index>(m.columns()),
             Eigen::OuterStride<>(static_cast<Eigen::Index>(m.stride())))
      .cast<double>();
}

PaddedRows<float> inFloat(const MatrixXd& m) {
  PaddedRows<float> result(static_cast<size_t>(m.rows()), static_cast<size_t>(m.cols()));
  for (size_t i = 0; i < result.rows(); ++i)
    for (size_t k = 0; k < result.columns(); ++k)
      result.row(i)[k] = static_cast<float>(m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)));
  return result;
}

MatrixXd orthonormal(const MatrixXd& columns) {
  return Eigen::HouseholderQR<MatrixXd>(columns).householderQ() *
         MatrixXd::Identity(columns.rows(), columns.cols());
}

// Singular vectors v of T, the longest first, with their images T v = sigma u.
struct Singular {
  Eigen::VectorXd squares; // sigma^2
  MatrixXd vectors, images;
};

// At least `terms` of a tall matrix, given functions that multiply by T and by T'. Subspace iteration from
// random columns [Halko 2011, Alg. 4.4], with the singular values of T on the subspace.
Singular leadingVectors(size_t size, size_t terms, const auto& product, const auto& transposedProduct) {
  const auto columns = static_cast<Eigen::Index>(std::min(size, terms + kSpare));
  std::mt19937 random(1);
  MatrixXd basis = orthonormal(MatrixXd::NullaryExpr(static_cast<Eigen::Index>(size), columns,
                                                     [&] { return double(random()) * 0x1p-31 - 1; }));
  for (int step = 1;; ++step) {
    const PaddedRows<float> image = product(inFloat(basis));
    const MatrixXd images = inDouble(image);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(images.transpose() * images);
    const MatrixXd turn = solver.eigenvectors().rowwise().reverse();
    Singular found{solver.eigenvalues().reverse(), basis * turn, images * turn};
    if (step == kMostSteps || columns == static_cast<Eigen::Index>(size)) return found;
    const MatrixXd next = inDouble(transposedProduct(image)) * turn; // T' T v
    const auto wanted = static_cast<Eigen::Index>(terms);
    const MatrixXd residuals =
        next.leftCols(wanted) - found.vectors.leftCols(wanted) * found.squares.head(wanted).asDiagonal();
    if (residuals.colwise().norm().maxCoeff() <= kResidual * found.squares[0]) return found;
    basis = orthonormal(next);
  }
}

} // namespace

std::vector<float> takeMean(ArrangedMatrix& matrix) {
  std::vector<float> mean(matrix.rows() * matrix.planes);
  for (size_t row = 0; row < matrix.rows(); ++row)
    for (size_t c = 0; c < matrix.planes; ++c) {
      float* const values = matrix.plane(row, c);
      double sum = 0, weights = 0;
      for (size_t n = 0; n < matrix.cells; ++n) {
        const double weight = weightAt(matrix, row, n);
        sum += weight * double{values[n]};
        weights += weight;
      }
      const float ofRow = mean[row * matrix.planes + c] = static_cast<float>(sum / weights);
      for (size_t n = 0; n < matrix.cells; ++n)
        if (weightAt(matrix, row, n) > 0) values[n] -= ofRow;
    }
  return mean;
}

PlainFactors leadingTerms(const PaddedRows<float>& values, size_t terms, double negligible) {
  // T is the matrix or its transpose, whichever is tall.
  const bool isTall = values.columns() <= values.rows();
  const auto along = [&](const PaddedRows<float>& columns) { return product(values, columns); };
  const auto across = [&](const PaddedRows<float>& columns) { return innerProducts(values, columns); };
  const size_t size = std::min(values.rows(), values.columns());
  const double energy = inDouble(values).squaredNorm();
  Singular found;
  size_t wanted = 0;
  if (terms > 0 && energy > negligible) {
    terms = std::min(terms, size);
    found = isTall ? leadingVectors(size, terms, along, across) : leadingVectors(size, terms, across, along);
    const double shortest = kShortest * kShortest * found.squares[0];
    for (double rest = energy; wanted < terms && rest > negligible && found.squares[wanted] > shortest;)
      rest -= found.squares[wanted++];
  }
  const auto count = static_cast<Eigen::Index>(wanted);
  if (count == 0) return {PaddedRows<float>(values.rows(), 0), PaddedRows<float>(values.columns(), 0), {}};
  const auto lengths = found.squares.head(count).cwiseSqrt().eval();
  const MatrixXd vectors = found.vectors.leftCols(count), images = found.images.leftCols(count);
  if (isTall) return {inFloat(images), inFloat(vectors), {}};
  return {inFloat(vectors * lengths.asDiagonal()), inFloat(images * lengths.cwiseInverse().asDiagonal()), {}};
}

double roundingOf(const ArrangedMatrix& matrix) {
  double squares = 0;
  for (size_t row = 0; row < matrix.rows(); ++row)
    for (size_t c = 0; c < matrix.planes; ++c)
      for (size_t n = 0; n < matrix.cells; ++n)
        squares +=
            weightAt(matrix, row, n) * double{matrix.plane(row, c)[n]} * double{matrix.plane(row, c)[n]};
  return kRounding * kRounding * squares;
}

PlainFactors principalComponents(ArrangedMatrix matrix, size_t terms) {
  matrix.weights.reset();
  const double rounding = roundingOf(matrix);
  std::vector<float> mean = takeMean(matrix);
  PlainFactors factors = leadingTerms(matrix.values, terms, rounding);
  factors.mean = std::move(mean);
  return factors;
}

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

// Products of columns, summed over rows [first, first + weights.size()) by weight.
MatrixXd gramOf(const PaddedRows<float>& columns, std::span<const double> weights, size_t first = 0) {
  MatrixXd gram = MatrixXd::Zero(columns.columns(), columns.columns());
  for (size_t i = 0; i < weights.size(); ++i) {
    const VectorXd row = vectorAt(columns.row(first + i), columns.columns());
    gram.noalias() += weights[i] * row * row.transpose();
  }
  return gram;
}

// Weights, divided by their mean.
std::vector<double> shares(const std::vector<double>& weights) {
  double sum = 0;
  for (const double weight : weights) sum += weight;
  std::vector<double> result;
  for (const double weight : weights) result.push_back(weight * static_cast<double>(weights.size()) / sum);
  return result;
}

PaddedRows<float> transformed(const PaddedRows<float>& columns, const MatrixXd& by) {
  PaddedRows<float> matrix(by.rows(), by.cols());
  for (size_t i = 0; i < matrix.rows(); ++i)
    for (size_t k = 0; k < matrix.columns(); ++k) matrix.row(i)[k] = static_cast<float>(by(i, k));
  return product(columns, matrix);
}

// Weights of truncations 0..#terms, which are the mean and the first terms. The sum of their weighted squared
// errors
//
//   sum_k w_k sum |a - m - sum_{l <= k} u_l v_l|^2
//
// has the product u_l u_m of two terms with the weights of all truncations that hold both, W(max(l, m)),
// where W(l) = sum_{k >= l} w_k.
class Truncations {
public:
  // Weights 1 / error: the sum falls where the product of all errors does, so that each counts by its share.
  explicit Truncations(const std::vector<double>& errors) : rest_(static_cast<Eigen::Index>(errors.size())) {
    double rest = 0;
    for (size_t k = errors.size(); k-- > 0;)
      rest_[static_cast<Eigen::Index>(k)] = rest += errors.back() / errors[k];
  }

  double ofMean() const { return rest_[0]; }                    // W(0)
  auto ofTerms() const { return rest_.tail(rest_.size() - 1); } // W(1), W(2), ...
  // W(max(l, m))
  MatrixXd ofPairs() const {
    const Eigen::Index count = rest_.size() - 1;
    return MatrixXd::NullaryExpr(count, count,
                                 [&](Eigen::Index l, Eigen::Index m) { return rest_[std::max(l, m) + 1]; });
  }

private:
  VectorXd rest_; // W(0), W(1), ...
};

// Columns of two matrices, side by side.
PaddedRows<float> beside(const PaddedRows<float>& left, const PaddedRows<float>& right) {
  PaddedRows<float> matrix(left.rows(), left.columns() + right.columns());
  for (size_t i = 0; i < matrix.rows(); ++i)
    std::copy_n(right.row(i), right.columns(), std::copy_n(left.row(i), left.columns(), matrix.row(i)));
  return matrix;
}

class Fit {
public:
  // The mean of the matrix has been taken out. There are no terms yet.
  Fit(ArrangedMatrix matrix, double negligible);

  // Adds the leading term of what is left, times its weights. Returns whether that is more than rounding
  // error.
  bool addTerm();

  size_t terms() const { return factors_.terms(); }
  double squaredError() const { return errors_.back(); } // weighted; after fitRows()
  // Weighted squared errors of the mean and the first 0, 1, ... terms.
  const std::vector<double>& errors() const { return errors_; }

  // Fits U and the mean of each row to V.
  void fitRows(const Truncations& truncations);
  // Fits V to U and the mean.
  void fitCells(const Truncations& truncations);
  // Makes columns of V of unit length. All products stay.
  void normalise();

  PlainFactors factors() && { return std::move(factors_); }

private:
  // Precision of the priors times the variance of an observation.
  double priorOfSurface(size_t k) const {
    return priorOfCell() * static_cast<double>(sums_.rows()) / (lengths_[k] * static_cast<double>(numbers()));
  }
  double priorOfCell() const {
    return kPriorShare * squaredError() / entries_ * static_cast<double>(numbers());
  }
  size_t numbers() const { return sums_.planes() * sums_.cells(); } // of a column of V
  void setErrors(std::vector<double> errors) {
    errors_ = std::move(errors);
    for (double& error : errors_) error = std::max(error, negligible_);
  }

  PlainFactors factors_;
  std::vector<double> lengths_; // squared, of the columns of U
  std::vector<double> errors_;
  double entries_ = 0;
  double negligible_; // sum of squares that is rounding error
  WeightedSums sums_;
  std::vector<double> rowShares_, cellShares_; // weights of rows and cells; their means are 1
};

Fit::Fit(ArrangedMatrix matrix, double negligible)
    : negligible_(negligible), sums_(std::move(matrix)), rowShares_(shares(sums_.rowWeights())),
      cellShares_(shares(sums_.cellWeights())) {
  factors_.surface = PaddedRows<float>(sums_.rows(), 0);
  factors_.view = PaddedRows<float>(sums_.planes() * sums_.stride(), 0);
  factors_.mean.assign(sums_.planes() * sums_.rows(), 0);
  for (const double weights : sums_.rowWeights()) entries_ += weights * static_cast<double>(sums_.planes());
  setErrors({sums_.squares()});
}

bool Fit::addTerm() {
  const PlainFactors term = leadingTerms(sums_.weightedRest(factors_), 1, negligible_);
  if (term.terms() == 0) return false;
  const double length = gramOf(term.surface, std::vector<double>(sums_.rows(), 1))(0, 0);
  factors_.surface = beside(factors_.surface, term.surface);
  factors_.view = beside(factors_.view, term.view);
  lengths_.push_back(length);
  errors_.push_back(std::max(errors_.back() - length, negligible_));
  return true;
}

void Fit::fitRows(const Truncations& truncations) {
  const size_t count = terms();
  const PaddedRows<float> along = sums_.alongView(factors_.view);
  const PaddedRows<float> pairs = sums_.viewPairs(factors_.view, true);
  const VectorXd ofTerms = truncations.ofTerms();
  const MatrixXd ofPairs = truncations.ofPairs();
  VectorXd priors(count);
  for (size_t k = 0; k < count; ++k) priors[k] = priorOfSurface(k);
  std::vector<double> errors(count + 1, sums_.squares());
  for (size_t row = 0; row < sums_.rows(); ++row) {
    const MatrixXd gram = unpacked(pairs.row(row), count);
    const VectorXd right = vectorAt(along.row(row), count);
    const double weight = sums_.rowWeights()[row];
    // The mean m_c of plane c is W(0) weight m_c = W(0) b_c - (W p_c) u, which leaves equations for u alone.
    MatrixXd reduced = gram.cwiseProduct(ofPairs);
    VectorXd reducedRight = right.cwiseProduct(ofTerms);
    const auto sumOfView = [&](size_t c) {
      return vectorAt(pairs.row(row) + pairsOf(count) + c * count, count);
    };
    const double* const b = sums_.rowSums().data() + row * sums_.planes();
    for (size_t c = 0; c < sums_.planes(); ++c) {
      const VectorXd p = sumOfView(c).cwiseProduct(ofTerms);
      reduced.noalias() -= p * p.transpose() / (truncations.ofMean() * weight);
      reducedRight -= p * (b[c] / weight);
    }
    reduced.diagonal() += (priors.array() + kRidge * gram.trace()).matrix().cwiseProduct(ofTerms);
    const VectorXd u = reduced.ldlt().solve(reducedRight);
    store(u, factors_.surface.row(row));

    double squares = 0; // that the first terms add to the error of none, without a mean
    VectorXd alongMean(sums_.planes()), means(sums_.planes());
    for (size_t c = 0; c < sums_.planes(); ++c) {
      means[c] = (b[c] - sumOfView(c).cwiseProduct(ofTerms).dot(u) / truncations.ofMean()) / weight;
      factors_.mean[row * sums_.planes() + c] = static_cast<float>(means[c]);
      squares += means[c] * (weight * means[c] - 2 * b[c]);
    }
    errors[0] += squares;
    for (size_t k = 0; k < count; ++k) {
      const auto before = static_cast<Eigen::Index>(k);
      squares += u[k] * (gram(k, k) * u[k] + 2 * gram.col(k).head(before).dot(u.head(before)) - 2 * right[k]);
      for (size_t c = 0; c < sums_.planes(); ++c) squares += 2 * means[c] * sumOfView(c)[k] * u[k];
      errors[k + 1] += squares;
    }
  }
  setErrors(std::move(errors));
}

void Fit::fitCells(const Truncations& truncations) {
  const size_t count = terms();
  const PaddedRows<float> along = sums_.alongSurface(factors_.surface);
  const PaddedRows<float> pairs = sums_.surfacePairs(factors_.surface, factors_.mean);
  const VectorXd ofTerms = truncations.ofTerms();
  const MatrixXd ofPairs = truncations.ofPairs();
  for (size_t n = 0; n < sums_.cells(); ++n) {
    MatrixXd gram = unpacked(pairs.row(n), count);
    const double prior = priorOfCell() + kRidge * gram.trace();
    gram = gram.cwiseProduct(ofPairs);
    gram.diagonal() += prior * ofTerms;
    const Eigen::LDLT<MatrixXd> solver(gram);
    for (size_t c = 0; c < sums_.planes(); ++c) {
      const size_t place = c * sums_.stride() + n;
      const VectorXd right =
          vectorAt(along.row(place), count) - vectorAt(pairs.row(n) + pairsOf(count) + c * count, count);
      store(solver.solve(right.cwiseProduct(ofTerms)), factors_.view.row(place));
    }
  }
}

void Fit::normalise() {
  VectorXd squares = VectorXd::Zero(static_cast<Eigen::Index>(terms())), ofSurface = squares;
  for (size_t c = 0; c < sums_.planes(); ++c)
    squares += gramOf(factors_.view, cellShares_, c * sums_.stride()).diagonal();
  ofSurface = gramOf(factors_.surface, rowShares_).diagonal();
  const VectorXd lengths = squares.cwiseSqrt().cwiseMax(1e-30);
  factors_.view = transformed(factors_.view, lengths.cwiseInverse().asDiagonal());
  factors_.surface = transformed(factors_.surface, lengths.asDiagonal());
  for (Eigen::Index k = 0; k < lengths.size(); ++k)
    lengths_[static_cast<size_t>(k)] = std::max(squares[k] * ofSurface[k], negligible_);
}

} // namespace

PlainFactors weightedComponents(ArrangedMatrix matrix, const FitOptions& options, const Progress& progress) {
  const double negligible = roundingOf(matrix);
  const std::vector<float> mean = takeMean(matrix);
  Fit fit(std::move(matrix), negligible);
  const auto logarithm = [&] { // of the product of all RMS errors
    double sum = 0;
    for (const double error : fit.errors()) sum += std::log(error) / 2;
    return sum;
  };
  while (fit.terms() < options.terms && fit.addTerm()) {
    double before = std::numeric_limits<double>::infinity();
    for (size_t iteration = 0;; ++iteration) {
      progress.checkpoint();
      const Truncations truncations(fit.errors());
      fit.fitRows(truncations);
      fit.normalise();
      const double now = logarithm();
      if (iteration >= options.mostIterations || before - now < options.convergence) break;
      before = now;
      fit.fitCells(truncations);
    }
  }
  PlainFactors factors = std::move(fit).factors();
  for (size_t i = 0; i < mean.size(); ++i) factors.mean[i] += mean[i];
  return factors;
}

} // namespace surflect::lfm
