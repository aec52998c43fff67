// Nearest rotation to a matrix with rounded digits.
//
// [Higham 1986] Higham: Computing the polar decomposition with applications, SIAM J. Sci. Stat. Comput. 7(4).
// [Bjorck 1971] Bjorck, Bowie: An iterative algorithm for computing the best estimate of an orthogonal
// matrix, SIAM J. Numer. Anal. 8(2).
#pragma once

#include "surfel/math/space.h"

namespace surflect {

// Orthogonal polar factor of a matrix whose entries are within 0.01 of a rotation's  [Higham 1986].
inline Mat3<double> nearestRotation(const Mat3<double>& matrix) {
  Mat3<double> q = matrix;
  // q <- q (3 - q^T q) / 2 squares the distance [Bjorck 1971].
  for (int step = 0; step < 5; ++step)
    q = 0.5 * q * (3 * Mat3<double>::Identity() - q.transpose() * q).eval();
  return q;
}

} // namespace surflect
