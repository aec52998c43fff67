#include "render/lightfield/lfm/pca.h"

#include "surfel/math/padded_products.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

namespace surflect::lfm {

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

} // namespace surflect::lfm
