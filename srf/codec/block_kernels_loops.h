// The loops of block_kernels.h, for vectors of so many bytes. Sources with AVX include immintrin.h before.
#pragma once

#include "srf/codec/block_kernels.h"

#include <cstddef>

namespace surflect::codec {
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
// As doubles: of __builtin_convertvector g++ 12 makes halves.
template <class V> inline V widened(const float* from) {
#ifdef __AVX512F__
  if constexpr (sizeof(V) == 64) return V(_mm512_cvtps_pd(_mm256_loadu_ps(from)));
#endif
#ifdef __AVX2__
  if constexpr (sizeof(V) == 32) return V(_mm256_cvtps_pd(_mm_loadu_ps(from)));
#endif
  return __builtin_convertvector(loaded<Vector<float, sizeof(V) / 2>>(from), V);
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

// Columns from j on of some rows, as long as a tile of so many vectors fits; then of fewer.
template <class V, int rows, int vectors, class Real>
inline void tilesFrom(const MatrixProduct<Real>& p, size_t i, size_t j, size_t first) {
  constexpr size_t width = vectors * sizeof(V) / sizeof(Real);
  for (; j + width <= p.columns; j += width) tile<V, rows, vectors>(p, i, j, first);
  if constexpr (vectors > 1)
    tilesFrom<V, rows, vectors / 2>(p, i, j, first);
  else if constexpr (sizeof(V) > sizeof(Remaining<V, Real>))
    tilesFrom<Remaining<V, Real>, rows, 1>(p, i, j, first);
}

// All columns of some rows.
template <class V, int rows, int vectors, class Real>
inline void tiles(const MatrixProduct<Real>& p, size_t i) {
  for (size_t first = 0; first < p.inner; first += kChunk)
    tilesFrom<V, rows, vectors>(p, i, p.upper ? i / 8 * 8 : 0, first);
}

template <class Real, size_t bytes> void product(const MatrixProduct<Real>& p) {
  using V = Vector<Real, bytes>;
  constexpr size_t width = sizeof(V) / sizeof(Real);
  size_t i = 0;
  if (p.columns <= width) // else there are too few sums at once
    for (; i + 8 <= p.rows; i += 8) tiles<V, 8, 1>(p, i);
  for (; i + 4 <= p.rows; i += 4) tiles<V, 4, bytes == 64 ? 4 : 2>(p, i);
  for (; i < p.rows; ++i) tiles<V, 1, 8>(p, i);
}

// Of rows from j on.
template <int rows, class V, class Real>
inline void scalarProductsOf(const ScalarProducts<Real>& job, size_t j) {
  constexpr size_t width = sizeof(V) / sizeof(Real), vectors = 8 / width;
  V sums[rows][vectors] = {};
  for (size_t i = 0; i < job.length; i += 8)
#pragma GCC unroll 8
    for (size_t v = 0; v < vectors; ++v) {
      const V of = loaded<V>(job.v + i + v * width);
#pragma GCC unroll 8
      for (int r = 0; r < rows; ++r) sums[r][v] += loaded<V>(job.a + (j + r) * job.aRow + i + v * width) * of;
    }
#pragma GCC unroll 8
  for (int r = 0; r < rows; ++r) {
    Real s[8];
    __builtin_memcpy(s, sums[r], sizeof s);
    job.products[j + r] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
  }
}

template <class Real, size_t bytes> void scalarProducts(const ScalarProducts<Real>& job) {
  using V = Remaining<Vector<Real, bytes>, Real>;
  size_t j = 0;
  for (; j + 4 <= job.rows; j += 4) scalarProductsOf<4, V>(job, j);
  for (; j < job.rows; ++j) scalarProductsOf<1, V>(job, j);
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
#pragma GCC unroll 9
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

// Of the lights from j on, and so many texels, added to what the first ones left.
template <class V, size_t texels, bool seen>
inline void errorsOf(const BlockErrors& job, size_t first, size_t j) {
  constexpr size_t rows = 3 * texels;
  V shown[rows] = {};
  const double *levels = job.levels + 3 * first * job.terms, *perLevel = job.perLevel + j;
  for (size_t k = 0; k < job.terms; ++k, levels += 3, perLevel += job.lights) {
    const V p = loaded<V>(perLevel);
#pragma GCC unroll 12
    for (size_t i = 0; i < rows; ++i) shown[i] += levels[i / 3 * 3 * job.terms + i % 3] * p;
  }
  const V white = V{} + job.white, black{};
  V squares[3] = {}, clipped{};
  if (first > 0) {
#pragma GCC unroll 3
    for (size_t c = 0; c < 3; ++c) squares[c] = loaded<V>(job.squares + c * job.lights + j);
    if (seen) clipped = loaded<V>(job.clipped + j);
  }
#pragma GCC unroll 12
  for (size_t i = 0; i < rows; ++i) {
    const V x = widened<V>(job.x + (3 * first + i) * job.lights + j);
    const V error = x - shown[i];
    squares[i % 3] += error * error;
    if (!seen) continue;
    const V visible = smaller(larger(x, black), white) - smaller(larger(shown[i], black), white);
    clipped += visible * visible;
  }
#pragma GCC unroll 3
  for (size_t c = 0; c < 3; ++c) stored(job.squares + c * job.lights + j, squares[c]);
  if (seen) stored(job.clipped + j, clipped);
}

template <size_t bytes, bool seen> inline void errorsOf(const BlockErrors& job) {
  using V = Vector<double, bytes>;
  constexpr size_t width = sizeof(V) / sizeof(double);
  constexpr size_t kTexels = bytes == 64 ? 4 : 2; // as registers hold
  size_t texel = 0;
  for (; texel + kTexels <= job.texels; texel += kTexels)
    for (size_t j = 0; j < job.lights; j += width) errorsOf<V, kTexels, seen>(job, texel, j);
  for (; texel < job.texels; ++texel)
    for (size_t j = 0; j < job.lights; j += width) errorsOf<V, 1, seen>(job, texel, j);
}

template <size_t bytes> void errors(const BlockErrors& job) {
  if (job.clipped)
    errorsOf<bytes, true>(job);
  else
    errorsOf<bytes, false>(job);
}

template <size_t bytes> constexpr BlockKernels kernelsOf() {
  return {product<float, bytes>,
          product<double, bytes>,
          scalarProducts<float, bytes>,
          scalarProducts<double, bytes>,
          rounding<float, bytes>,
          rounding<double, bytes>,
          errors<bytes>};
}

} // namespace
} // namespace surflect::codec
