// Truncated singular value decomposition of a weighted block, before its terms are rounded.
#pragma once

#include "srf/codec/padded_rows.h"

#include <vector>

namespace surflect::codec {

// V X W, with V and W the weights of rows and lights, scaled so that |V X W|_F^2 is about 1.
template <class Real> struct WeightedBlock {
  PaddedRows<Real> values;        // [texels x channels][lights]
  std::vector<Real> rows, lights; // the diagonals of V and W
  double squaredBound = 0;        // bound on the squared error
};

// V X W ~ sum_k sigma_k e_k a_k', where e_k and a_k have unit length.
template <class Real> struct BlockFactors {
  PaddedRows<Real> images;      // e_k [texels x channels][terms]
  PaddedRows<Real> lights;      // a_k [lights][terms]
  std::vector<double> energies; // sigma_k^2, descending
  double energy = 0;            // |V X W|_F^2
};

// Factors a block into enough terms to leave at most `left` of |V X W|_F^2; if `left` is 0, into all terms
// above rounding error.
template <class Real> BlockFactors<Real> factorised(const WeightedBlock<Real>& block, Real left);

} // namespace surflect::codec
