// The strongest terms of a block, before they are rounded.
#pragma once

#include "srf/codec/padded_rows.h"

#include <vector>

namespace surflect::codec {

// V X W, with V and W the weights of rows and lights, scaled so that |V X W|_F^2 is about 1.
template <class Real> struct WeightedBlock {
  PaddedRows<Real> values;        // [texels x channels][lights]
  std::vector<Real> rows, lights; // the diagonals of V and W
  double squaredBound = 0;        // of the error
};

// V X W ~ sum_k sigma_k e_k a_k', with e_k and a_k of length 1.
template <class Real> struct BlockFactors {
  PaddedRows<Real> images;      // e_k [texels x channels][terms]
  PaddedRows<Real> lights;      // a_k [lights][terms]
  std::vector<double> energies; // sigma_k^2, falling
  double energy = 0;            // |V X W|_F^2
};

// As many terms as leave at most `left` of |V X W|_F^2; 0: all that are not lost in rounding.
template <class Real> BlockFactors<Real> factorised(const WeightedBlock<Real>& block, Real left);

} // namespace surflect::codec
