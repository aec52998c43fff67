// Truncated singular value decomposition of a dense matrix.
#pragma once

#include "surfel/math/padded_rows.h"

#include <vector>

namespace surflect {

// X ~ sum_k sigma_k u_k v_k', where the u_k and the v_k have unit length and are orthogonal.
template <class Real> struct TruncatedSvd {
  PaddedRows<Real> left;        // u_k [rows][terms]
  PaddedRows<Real> right;       // v_k [columns][terms]
  std::vector<double> energies; // sigma_k^2, descending
  double energy = 0;            // |X|_F^2
};

// Enough terms to leave at most `tolerated` of |X|_F^2; all terms above rounding error if `tolerated` is 0.
// Singular vectors are those of the smaller Gram matrix, X' X or X X', found as dominantEigenvectors
// (dominant_eigenvectors.h) does, with its errors.
template <class Real> TruncatedSvd<Real> truncatedSvd(const PaddedRows<Real>& x, Real tolerated);

} // namespace surflect
