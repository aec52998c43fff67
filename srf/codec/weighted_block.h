// A block with weighted errors, as it is factored and rounded.
#pragma once

#include "surfel/math/padded_rows.h"

#include <vector>

namespace surflect::codec {

// V X W, with V and W the weights of rows and lights, scaled so that |V X W|_F^2 is about 1.
template <class Real> struct WeightedBlock {
  PaddedRows<Real> values;        // [texels x channels][lights]
  std::vector<Real> rows, lights; // the diagonals of V and W
  double squaredBound = 0;        // bound on the squared error
};

} // namespace surflect::codec
