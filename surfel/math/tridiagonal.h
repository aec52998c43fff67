// Eigenvalues and eigenvectors of a symmetric tridiagonal matrix.
#pragma once

#include "surfel/math/padded_rows.h"

#include <span>
#include <vector>

namespace surflect {

template <class Real> struct TridiagonalSpectrum {
  std::vector<Real> values; // descending
  PaddedRows<Real> vectors; // one per row, in the order of values
};

// Decomposes a tridiagonal matrix given its diagonal and subdiagonal (one shorter). Errors are a few rounding
// errors of the largest eigenvalue. Implicit QR with Wilkinson's shift [Golub and Van Loan 1996, §8.3.3].
template <class Real>
TridiagonalSpectrum<Real> tridiagonalSpectrum(std::span<const Real> diagonal, std::span<const Real> beside);

} // namespace surflect
