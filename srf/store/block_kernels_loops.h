// The loops of block_kernels.h, for vectors of so many bytes.
#pragma once

#include "srf/store/block_kernels.h"

#include <cstddef>

namespace surflect {
namespace {

template <class Real, size_t bytes> struct VectorOf;
template <> struct VectorOf<float, 8> { typedef float Type __attribute__((vector_size(8))); };
template <> struct VectorOf<float, 16> { typedef float Type __attribute__((vector_size(16))); };
template <> struct VectorOf<float, 32> { typedef float Type __attribute__((vector_size(32))); };
template <> struct VectorOf<float, 64> { typedef float Type __attribute__((vector_size(64))); };
template <> struct VectorOf<double, 16> { typedef double Type __attribute__((vector_size(16))); };
template <> struct VectorOf<double, 32> { typedef double Type __attribute__((vector_size(32))); };
template <> struct VectorOf<double, 64> { typedef double Type __attribute__((vector_size(64))); };
template <class Real, size_t bytes> using Vector = typename VectorOf<Real, bytes>::Type;
// For what wide vectors V leave of a row: rows are padded to eight numbers.
template <class V, class Real>
using Remaining = Vector<Real, sizeof(V) < 8 * sizeof(Real) ? sizeof(V) : 8 * sizeof(Real)>;

template <class V, class Real> inline V loaded(const Real* from) {
  V v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
template <class V, class Real> inline void stored(Real* to, const V& v) {
  __builtin_memcpy(to, &v, sizeof v);
}
template <class V> inline V larger(const V& a, const V& b) { return a > b ? a : b; }
template <class V> inline V smaller(const V& a, const V& b) { return a < b ? a : b; }

constexpr size_t kChunk = 32; // summands; sums of sums lose less in rounding

// Rows i .. and vectors of columns from j of C, kept in registers while a chunk of the inner sum runs.
template <class V, int rows, int vectors, class Real>
inline void tile(const MatrixProduct<Real>& p, size_t i, size_t j, size_t first) {
  constexpr size_t width = sizeof(V) / sizeof(Real);
  const size_t end = p.inner - first < kChunk ? p.inner : first + kChunk;
  V sums[rows][vectors] = {};
  const Real* a = p.a + i * p.aRow + first * p.aColumn;
  const Real* b = p.b + j + first * p.bRow;
  for (size_t k = first; k < end; ++k, a += p.aColumn, b += p.bRow) {
    V of[vectors];
#pragma GCC unroll 8
    for (int v = 0; v < vectors; ++v) of[v] = loaded<V>(b + v * width);
#pragma GCC unroll 8
    for (int r = 0; r < rows; ++r) {
      const Real along = a[r * p.aRow];
#pragma GCC unroll 8
      for (int v = 0; v < vectors; ++v) sums[r][v] += along * of[v];
    }
  }
#pragma GCC unroll 8
  for (int r = 0; r < rows; ++r)
#pragma GCC unroll 8
    for (int v = 0; v < vectors; ++v) {
      Real* const c = p.c + (i + r) * p.cRow + j + v * width;
      stored(c, first == 0 ? sums[r][v] : loaded<V>(c) + sums[r][v]);
    }
}

// All columns of some rows.
template <class V, int rows, int vectors, class Real>
inline void tiles(const MatrixProduct<Real>& p, size_t i) {
  using Rest = Remaining<V, Real>;
  constexpr size_t width = sizeof(V) / sizeof(Real), restWidth = sizeof(Rest) / sizeof(Real);
  for (size_t first = 0; first < p.inner; first += kChunk) {
    size_t j = p.upper ? i / 8 * 8 : 0;
    for (; j + vectors * width <= p.columns; j += vectors * width) tile<V, rows, vectors>(p, i, j, first);
    for (; j + width <= p.columns; j += width) tile<V, rows, 1>(p, i, j, first);
    for (; j < p.columns; j += restWidth) tile<Rest, rows, 1>(p, i, j, first);
  }
}

template <class Real, size_t bytes> void product(const MatrixProduct<Real>& p) {
  using V = Vector<Real, bytes>;
  size_t i = 0;
  for (; i + 4 <= p.rows; i += 4) tiles<V, 4, 2>(p, i);
  for (; i < p.rows; ++i) tiles<V, 1, 8>(p, i);
}

// Of the columns from j on, as many as V has numbers.
template <class V, class Real> inline void roundingOf(const Rounding<Real>& job, size_t j) {
  V peak{};
  for (size_t i = 0; i < job.rows; ++i) {
    const V x = loaded<V>(job.values + i * job.columns + j) * job.inverseWeights[i];
    peak = larger(peak, larger(x, -x));
  }
  V steps[roundings], scales[roundings], sums[roundings] = {};
  for (size_t r = 0; r < roundings; ++r) {
    steps[r] = peak * (job.clip[r] / job.last[r]);
    scales[r] = 1 / steps[r];
  }
  for (size_t i = 0; i < job.rows; ++i) {
    const V x = loaded<V>(job.values + i * job.columns + j) * job.inverseWeights[i];
#pragma GCC unroll 7
    for (size_t r = 0; r < roundings; ++r) {
      const V last = V{} + job.last[r];
      const V level = larger(smaller(x * scales[r], last), -last) + wholeShift<Real> - wholeShift<Real>;
      const V error = (x - steps[r] * level) * job.weights[i];
      sums[r] += error * error;
    }
  }
  for (size_t r = 0; r < roundings; ++r) stored(job.squaredErrors + r * job.columns + j, sums[r]);
}

template <class Real, size_t bytes> void rounding(const Rounding<Real>& job) {
  using V = Vector<Real, bytes>;
  using Rest = Remaining<V, Real>;
  constexpr size_t width = sizeof(V) / sizeof(Real), restWidth = sizeof(Rest) / sizeof(Real);
  size_t j = 0;
  for (; j + width <= job.columns; j += width) roundingOf<V>(job, j);
  for (; j < job.columns; j += restWidth) roundingOf<Rest>(job, j);
}

template <size_t bytes, bool seen> inline void errorsOf(const BlockErrors& job) {
  using V = Vector<double, bytes>;
  constexpr size_t width = sizeof(V) / sizeof(double);
  using Floats = Vector<float, bytes / 2>;
  const V white = V{} + job.white, black{};
  for (size_t j = 0; j < job.lights; j += width) {
    V squares[3] = {}, clipped{};
    for (size_t texel = 0; texel < job.texels; ++texel) {
      const double* levels = job.levels + 3 * texel * job.terms;
      V sums[3] = {};
      const double* perLevel = job.perLevel + j;
      for (size_t k = 0; k < job.terms; ++k, perLevel += job.lights) {
        const V p = loaded<V>(perLevel);
#pragma GCC unroll 3
        for (size_t c = 0; c < 3; ++c) sums[c] += levels[c * job.terms + k] * p;
      }
#pragma GCC unroll 3
      for (size_t c = 0; c < 3; ++c) {
        const V x = __builtin_convertvector(loaded<Floats>(job.x + (3 * texel + c) * job.lights + j), V);
        const V error = x - sums[c];
        squares[c] += error * error;
        if (!seen) continue;
        const V visible = smaller(larger(x, black), white) - smaller(larger(sums[c], black), white);
        clipped += visible * visible;
      }
    }
    for (size_t c = 0; c < 3; ++c) stored(job.squares + c * job.lights + j, squares[c]);
    if (seen) stored(job.clipped + j, clipped);
  }
}

template <size_t bytes> void errors(const BlockErrors& job) {
  if (job.clipped)
    errorsOf<bytes, true>(job);
  else
    errorsOf<bytes, false>(job);
}

template <size_t bytes> constexpr BlockKernels kernelsOf() {
  return {product<float, bytes>, product<double, bytes>, rounding<float, bytes>, rounding<double, bytes>,
          errors<bytes>};
}

} // namespace
} // namespace surflect
