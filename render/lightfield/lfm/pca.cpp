#include "render/lightfield/lfm/pca.h"

#include "surfel/math/leading_svd.h"

#include <cmath>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

// Rest of a matrix after its mean that counts as rounding error, as a share of its root mean square.
constexpr double kRounding = 1e-6;

float weightAt(const ArrangedMatrix& matrix, size_t row, size_t cell) {
  return matrix.weights ? matrix.weights->row(row)[cell] : 1.0f;
}

PaddedRows<float> scaledColumns(const PaddedRows<float>& columns, const std::vector<double>& squares) {
  PaddedRows<float> result(columns.rows(), columns.columns());
  for (size_t i = 0; i < result.rows(); ++i)
    for (size_t k = 0; k < result.columns(); ++k)
      result.row(i)[k] = static_cast<float>(columns.row(i)[k] * std::sqrt(squares[k]));
  return result;
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
  TruncatedSvd<float> svd = leadingSvd(values, terms, negligible);
  return {scaledColumns(svd.left, svd.energies), std::move(svd.right), {}};
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
