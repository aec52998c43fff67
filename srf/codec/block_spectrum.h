// The strongest eigenvectors of a Gram matrix.
#pragma once

#include "srf/codec/padded_rows.h"

namespace surflect::codec {

template <class Real> struct Spectrum {
  PaddedRows<Real> vectors; // [rows of the Gram matrix][terms], orthonormal columns; the strongest first
  double trace = 0;
};

// Of a symmetric, positive matrix, as many as leave at most `tolerated` of its trace, and a few more; 0, or
// where that takes many: all that are not lost in rounding. Those needed are so near to eigenvectors that
// they miss a hundredth of `tolerated` at most.
//
// [Lanczos 1950], with each vector made orthogonal to all before it: it ends where the rest does not matter,
// long before there are as many vectors as rows.
template <class Real> Spectrum<Real> strongestVectors(const PaddedRows<Real>& gram, Real tolerated);

} // namespace surflect::codec
