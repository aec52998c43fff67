// The strongest eigenvectors of a Gram matrix.
#pragma once

#include "srf/store/padded_rows.h"

namespace surflect {

template <class Real> struct Spectrum {
  PaddedRows<Real> vectors; // [rows of the Gram matrix][terms], orthonormal columns; the strongest first
};

// Of a symmetric, positive matrix, as many as leave at most `tolerated` of its trace; 0: all that are not lost
// in rounding. Each is as near to an eigenvector as that asks for: together with the sum of what the others
// would have, the vectors miss a hundredth of `tolerated` at most.
//
// [Lanczos 1950], with each vector made orthogonal to all before it: it ends where the rest does not matter,
// long before there are as many vectors as rows.
template <class Real> Spectrum<Real> strongestVectors(const PaddedRows<Real>& gram, Real tolerated);

} // namespace surflect
