// Vectorised matrix loops of the block encoder. Every instruction set gives the same bits: sums run in the
// order of rows, without fused multiply-add.
//
// Matrices are stored row by row; every row is padded with zeros to a multiple of eight numbers.
#pragma once

#include <cstddef>
#include <limits>

namespace surflect::codec {

// Adding and then subtracting this number rounds to the nearest integer. It is 1.5 times the power of two
// above which a Real has no fraction bits.
template <class Real>
inline constexpr Real wholeShift = Real(3ull << (std::numeric_limits<Real>::digits - 2));

// C = A B, where A(i, k) = a[i aRow + k aColumn]. If `upper`, C is symmetric and only the 8 x 8 blocks on and
// right of its diagonal are computed.
template <class Real> struct MatrixProduct {
  const Real* a;
  size_t aRow, aColumn;
  const Real* b;
  size_t bRow;
  Real* c;
  size_t cRow;
  size_t rows, inner, columns; // rows of C; length of the inner sum; padded columns of C
  bool upper;
};
void multiply(const MatrixProduct<float>&);
void multiply(const MatrixProduct<double>&);

// a_j . v for each row a_j of a matrix. Products are summed in eight interleaved sums, which are then added
// pairwise. `length` is padded.
template <class Real> struct ScalarProducts {
  const Real* a;
  size_t aRow, rows;
  const Real* v;
  size_t length;
  Real* products; // [rows]
};
void multiply(const ScalarProducts<float>&);
void multiply(const ScalarProducts<double>&);

// Squared errors of rounding the columns of a matrix to levels -last .. last, for several pairs (last, clip)
// at once. Row i is stored divided by weights[i]; `last` stands for clip times the largest stored value of a
// column, and larger values are clipped.
inline constexpr size_t roundings = 9;
template <class Real> struct Rounding {
  const Real* values;
  size_t rows, columns; // padded
  const Real* weights;
  const Real* inverseWeights;
  Real last[roundings], clip[roundings];
  Real* squaredErrors; // [roundings][columns]
};
void roundingErrors(const Rounding<float>&);
void roundingErrors(const Rounding<double>&);

// Squared error |X - levels P|^2 over texels, for each channel and light. If `clipped` is not null, also the
// squared error of X and levels P clipped to [0, white], over texels and channels, for each light.
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
