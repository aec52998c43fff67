// Truncated singular value decomposition of a dense matrix.
#pragma once

#include "surfel/math/padded_rows.h"

#include <vector>

namespace surflect {

// Dominant eigenvectors of a Gram matrix.
template <class Real> struct Eigenvectors {
  PaddedRows<Real> vectors; // [rows of the Gram matrix][terms], orthonormal columns by descending eigenvalue
  double trace = 0;
};

// Eigenvectors of a symmetric, positive semidefinite matrix that leave at most `tolerated` of its trace, and
// a few more. Returns all eigenvectors above rounding error if `tolerated` is 0, or if most of them are
// needed to reach it. The eigenvectors are approximate: together they miss at most a hundredth of
// `tolerated`.
//
// Lanczos iteration [Lanczos 1950] with full reorthogonalisation, stopped once the remainder is small enough,
// which takes far fewer steps than the matrix has rows.
template <class Real> Eigenvectors<Real> dominantEigenvectors(const PaddedRows<Real>& gram, Real tolerated);

// X ~ sum_k sigma_k u_k v_k', where the u_k and the v_k have unit length and are orthogonal.
template <class Real> struct TruncatedSvd {
  PaddedRows<Real> left;        // u_k [rows][terms]
  PaddedRows<Real> right;       // v_k [columns][terms]
  std::vector<double> energies; // sigma_k^2, descending
  double energy = 0;            // |X|_F^2
};

// Enough terms to leave at most `tolerated` of |X|_F^2; all terms above rounding error if `tolerated` is 0.
// Singular vectors are those of the smaller Gram matrix, X' X or X X', found as dominantEigenvectors
// above does, with its errors.
template <class Real> TruncatedSvd<Real> truncatedSvd(const PaddedRows<Real>& x, Real tolerated);

} // namespace surflect
