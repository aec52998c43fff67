#include "surfel/math/truncated_svd.h"

#include "surfel/math/dominant_eigenvectors.h"
#include "surfel/math/matrix_products.h"
#include "surfel/math/padded_products.h"
#include "surfel/math/transpose.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace surflect {

namespace {

// The Gram matrix M' M.
template <class Real> PaddedRows<Real> gramOf(const PaddedRows<Real>& m) {
  PaddedRows<Real> gram(m.columns(), m.columns());
  multiply(MatrixProduct<Real>{m.row(0), 1, m.stride(), m.row(0), m.stride(), gram.row(0), gram.stride(),
                               gram.rows(), m.rows(), gram.stride(), true});
  constexpr size_t kBlock = 8; // the diagonal 8 x 8 blocks are complete
  for (size_t i = kBlock; i < gram.rows(); i += kBlock)
    transpose(gram.row(0) + i, gram.stride(), i, std::min(kBlock, gram.rows() - i), gram.row(i),
              gram.stride());
  return gram;
}

// M v / |M v| for each column v of `vectors`; appends |M v|^2 to `squaredLengths`.
template <class Real>
PaddedRows<Real> directions(const PaddedRows<Real>& m, const PaddedRows<Real>& vectors,
                            std::vector<double>& squaredLengths) {
  PaddedRows<Real> result = product(m, vectors);
  for (size_t first = 0; first < result.stride(); first += 8) {
    std::array<Real, 8> squares{}, scales;
    for (size_t i = 0; i < result.rows(); ++i)
      for (size_t k = 0; k < 8; ++k) squares[k] += result.row(i)[first + k] * result.row(i)[first + k];
    for (size_t k = 0; k < 8; ++k) scales[k] = squares[k] > 0 ? 1 / std::sqrt(squares[k]) : 0;
    for (size_t i = 0; i < result.rows(); ++i)
      for (size_t k = 0; k < 8; ++k) result.row(i)[first + k] *= scales[k];
    for (size_t k = 0; k < 8 && first + k < result.columns(); ++k)
      squaredLengths.push_back(static_cast<double>(squares[k]));
  }
  return result;
}

} // namespace

template <class Real> TruncatedSvd<Real> truncatedSvd(const PaddedRows<Real>& x, Real tolerated) {
  const bool isNarrow = x.columns() <= x.rows();
  const PaddedRows<Real> turned = isNarrow ? PaddedRows<Real>(0, 0) : transposed(x);
  const PaddedRows<Real>& narrow = isNarrow ? x : turned;
  const PaddedRows<Real> gram = gramOf(narrow);
  Eigenvectors<Real> spectrum = dominantEigenvectors(gram, tolerated);

  std::vector<double> energies;
  PaddedRows<Real> along = directions(narrow, spectrum.vectors, energies);
  if (isNarrow) return {std::move(along), std::move(spectrum.vectors), std::move(energies), spectrum.trace};
  return {std::move(spectrum.vectors), std::move(along), std::move(energies), spectrum.trace};
}

template TruncatedSvd<float> truncatedSvd(const PaddedRows<float>&, float);
template TruncatedSvd<double> truncatedSvd(const PaddedRows<double>&, double);

} // namespace surflect
