// The loops over whole matrices that encoding a block spends its time in, in vector instructions; all give
// the same bits: every number is summed in the order of the rows, and nothing is contracted.
//
// Matrices lie row by row; a row has a multiple of eight numbers, where what is too many is zero.
#pragma once

#include <cstddef>
#include <limits>

namespace surflect::codec {

// x + it - it is x to the nearest whole number: one and a half times the power of two from which on a Real
// has no fraction.
template <class Real>
inline constexpr Real wholeShift = Real(3ull << (std::numeric_limits<Real>::digits - 2));

// C = A B. A(i, k) = a[i aRow + k aColumn]. `upper`: of a symmetric C only the squares of 8 x 8 on the
// diagonal and right of it.
template <class Real> struct MatrixProduct {
  const Real* a;
  size_t aRow, aColumn;
  const Real* b;
  size_t bRow;
  Real* c;
  size_t cRow;
  size_t rows, inner, columns; // of C, summed over, of C as padded
  bool upper;
};
void multiply(const MatrixProduct<float>&);
void multiply(const MatrixProduct<double>&);

// a_j . v for each row a_j of a matrix: the sums of each eighth product, and these by halves. `length`: as
// padded.
template <class Real> struct ScalarProducts {
  const Real* a;
  size_t aRow, rows;
  const Real* v;
  size_t length;
  Real* products; // [rows]
};
void multiply(const ScalarProducts<float>&);
void multiply(const ScalarProducts<double>&);

// What rounding to levels -last .. last leaves of the columns of a matrix, of which row i is stored divided
// by weights[i]: the squared error of a column whose largest stored value is put on last / clip, and larger
// levels on last. Of several pairs of last and clip at once.
inline constexpr size_t roundings = 9;
template <class Real> struct Rounding {
  const Real* values;
  size_t rows, columns; // as padded
  const Real* weights;
  const Real* inverseWeights;
  Real last[roundings], clip[roundings];
  Real* squaredErrors; // [roundings][columns]
};
void roundingErrors(const Rounding<float>&);
void roundingErrors(const Rounding<double>&);

// |X - levels P|^2 for each channel and light, over texels; and, where it is wanted, for each light over
// texels and channels that of X and levels P clipped to [0, white].
struct BlockErrors {
  const float* x; // [texels][3 channels][lights]
  size_t texels, lights;
  const double* levels;   // [texels][terms][3 channels]
  const double* perLevel; // P [terms][lights]
  size_t terms;
  double white;
  double* squares; // [3 channels][lights]
  double* clipped; // [lights], or null
};
void blockErrors(const BlockErrors&);

} // namespace surflect::codec
