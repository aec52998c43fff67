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
  // cells to the mean of the rows. The product stays, u (v - m)' + u m' = u v', since all rows share m. Rows
  // and cells count by their mean weights.
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
  std::vector<double> rowShares_, cellShares_; // weights of rows and cells; their means are 1
};

Fit::Fit(ArrangedMatrix matrix, size_t terms, double negligible)
    : negligible_(negligible), sums_(std::move(matrix)), rowShares_(shares(sums_.rowWeights())),
      cellShares_(shares(sums_.cellWeights())) {
  factors_ = leadingTerms(sums_.weightedValues(), terms, negligible_);
  factors_.mean.assign(sums_.planes() * sums_.rows(), 0);
  for (const double weights : sums_.rowWeights()) entries_ += weights * static_cast<double>(sums_.planes());
  const MatrixXd gram = gramOf(factors_.surface, std::vector<double>(sums_.rows(), 1));
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
      mean += cellShares_[n] * vectorAt(factors_.view.row(c * sums_.stride() + n), count);
    mean /= static_cast<double>(sums_.cells());
    for (size_t n = 0; n < sums_.cells(); ++n)
      for (size_t k = 0; k < count; ++k)
        factors_.view.row(c * sums_.stride() + n)[k] -= static_cast<float>(mean[k]);
    for (size_t row = 0; row < sums_.rows(); ++row)
      factors_.mean[row * sums_.planes() + c] +=
          static_cast<float>(vectorAt(factors_.surface.row(row), count).dot(mean));
  }
  // V = W S, where W is orthonormal; U S' = Q L R' gives U V' = (Q L) (W R)'.
  MatrixXd viewGram = MatrixXd::Zero(count, count);
  for (size_t c = 0; c < sums_.planes(); ++c)
    viewGram += gramOf(factors_.view, cellShares_, c * sums_.stride());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> ofView(viewGram);
  const VectorXd roots = ofView.eigenvalues().cwiseMax(0).cwiseSqrt();
  const VectorXd inverse = roots.unaryExpr(
      [&](double root) { return root > 1e-6 * roots.maxCoeff() && root > 0 ? 1 / root : 0.0; });
  const MatrixXd spread = ofView.eigenvectors() * roots.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> ofProduct(spread.transpose() *
                                                          gramOf(factors_.surface, rowShares_) * spread);
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
