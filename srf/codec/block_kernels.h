// Vectorised loops of the block encoder. Every instruction set gives the same bits: sums run in the order of
// rows, without fused multiply-add. Matrices are PaddedRows.
#pragma once

#include <cstddef>
#include <limits>

namespace surflect::codec {

// Adding and then subtracting this number rounds to the nearest integer. It is 1.5 times the power of two
// above which a Real has no fraction bits.
template <class Real>
inline constexpr Real wholeShift = Real(3ull << (std::numeric_limits<Real>::digits - 2));

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
