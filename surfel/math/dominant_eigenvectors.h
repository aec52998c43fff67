// Dominant eigenvectors of a Gram matrix.
#pragma once

#include "surfel/math/padded_rows.h"

namespace surflect {

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

} // namespace surflect
