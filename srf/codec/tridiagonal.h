// Eigenvalues and eigenvectors of a symmetric tridiagonal matrix.
#pragma once

#include "srf/codec/padded_rows.h"

#include <span>
#include <vector>

namespace surflect::codec {

template <class Real> struct TridiagonalSpectrum {
  std::vector<Real> values; // falling
  PaddedRows<Real> vectors; // of the values, a row each
};

// Of a matrix with these numbers on its diagonal and, one fewer, beside it; all are off by a few roundings of
// the largest value. [Golub and Van Loan 1996, §8.3.3], implicit QR steps with Wilkinson's shift.
template <class Real>
TridiagonalSpectrum<Real> tridiagonalSpectrum(std::span<const Real> diagonal, std::span<const Real> beside);

} // namespace surflect::codec
