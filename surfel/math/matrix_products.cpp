#include "surfel/math/matrix_products.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "surfel/math/matrix_products.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Vectors of 64 bytes at most, and of eight numbers for the remainder of a row, which is padded to eight.
template <class Real> using Wide = hn::CappedTag<Real, 64 / sizeof(Real)>;
template <class Real> using Eight = hn::CappedTag<Real, 8>;
constexpr bool kManyRegisters = hn::MaxLanes(Wide<float>()) == 16;

constexpr size_t kChunk = 32; // products summed at once; sums of partial sums round less

// Accumulates rows i .. i + rows - 1 and `vectors` vectors of columns from j of C, in registers, over one
// chunk of the inner sum.
template <class D, int rows, int vectors, class Real>
HWY_INLINE void tile(D d, const MatrixProduct<Real>& p, size_t i, size_t j, size_t first) {
  constexpr size_t width = hn::MaxLanes(D());
  const size_t end = p.inner - first < kChunk ? p.inner : first + kChunk;
  hn::Vec<D> sums[rows][vectors];
#pragma GCC unroll 8
  for (auto& row : sums)
#pragma GCC unroll 8
    for (auto& sum : row) sum = hn::Zero(d);
  const Real* a = p.a + i * p.aRow + first * p.aColumn;
  const Real* b = p.b + j + first * p.bRow;
  for (size_t k = first; k < end; ++k, a += p.aColumn, b += p.bRow) {
    hn::Vec<D> of[vectors];
#pragma GCC unroll 8
    for (int v = 0; v < vectors; ++v) of[v] = hn::LoadU(d, b + v * width);
#pragma GCC unroll 8
    for (int r = 0; r < rows; ++r) {
      const auto along = hn::Set(d, a[r * p.aRow]);
#pragma GCC unroll 8
      for (int v = 0; v < vectors; ++v) sums[r][v] = sums[r][v] + along * of[v];
    }
  }
#pragma GCC unroll 8
  for (int r = 0; r < rows; ++r)
#pragma GCC unroll 8
    for (int v = 0; v < vectors; ++v) {
      Real* const c = p.c + (i + r) * p.cRow + j + v * width;
      hn::StoreU(first == 0 && !p.isAdded ? sums[r][v] : hn::LoadU(d, c) + sums[r][v], d, c);
    }
}

// Columns from j on of some rows: tiles of `vectors` vectors while they fit, then narrower ones.
template <int rows, int vectors, class D, class Real>
HWY_INLINE void tilesFrom(D d, const MatrixProduct<Real>& p, size_t i, size_t j, size_t first) {
  constexpr size_t width = vectors * hn::MaxLanes(D());
  for (; j + width <= p.columns; j += width) tile<D, rows, vectors>(d, p, i, j, first);
  if constexpr (vectors > 1)
    tilesFrom<rows, vectors / 2>(d, p, i, j, first);
  else if constexpr (width > 8)
    tilesFrom<rows, 1>(Eight<Real>(), p, i, j, first);
}

// Computes all columns of `rows` rows.
template <int rows, int vectors, class D, class Real>
HWY_INLINE void tiles(D d, const MatrixProduct<Real>& p, size_t i) {
  for (size_t first = 0; first < p.inner; first += kChunk)
    tilesFrom<rows, vectors>(d, p, i, p.upper ? i / 8 * 8 : 0, first);
}

template <class Real> void product(const MatrixProduct<Real>& p) {
  const Wide<Real> d;
  constexpr size_t width = hn::MaxLanes(Wide<Real>());
  size_t i = 0;
  if (p.columns <= width) // a narrow C: more rows at once, for enough independent sums
    for (; i + 8 <= p.rows; i += 8) tiles<8, 1>(d, p, i);
  for (; i + 4 <= p.rows; i += 4) tiles<4, kManyRegisters ? 4 : 2>(d, p, i);
  for (; i < p.rows; ++i) tiles<1, 8>(d, p, i);
}

// Scalar products of `rows` rows from row j on.
template <int rows, class Real> HWY_INLINE void scalarProductsOf(const ScalarProducts<Real>& job, size_t j) {
  const Eight<Real> d;
  constexpr size_t width = hn::MaxLanes(Eight<Real>()), vectors = 8 / width;
  hn::Vec<Eight<Real>> sums[rows][vectors];
#pragma GCC unroll 8
  for (auto& row : sums)
#pragma GCC unroll 8
    for (auto& sum : row) sum = hn::Zero(d);
  for (size_t i = 0; i < job.length; i += 8)
#pragma GCC unroll 8
    for (size_t v = 0; v < vectors; ++v) {
      const auto of = hn::LoadU(d, job.v + i + v * width);
#pragma GCC unroll 8
      for (int r = 0; r < rows; ++r)
        sums[r][v] = sums[r][v] + hn::LoadU(d, job.a + (j + r) * job.aRow + i + v * width) * of;
    }
#pragma GCC unroll 8
  for (int r = 0; r < rows; ++r) {
    Real s[8];
#pragma GCC unroll 8
    for (size_t v = 0; v < vectors; ++v) hn::StoreU(sums[r][v], d, s + v * width);
    job.products[j + r] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
  }
}

template <class Real> void scalarProducts(const ScalarProducts<Real>& job) {
  size_t j = 0;
  for (; j + 4 <= job.rows; j += 4) scalarProductsOf<4>(job, j);
  for (; j < job.rows; ++j) scalarProductsOf<1>(job, j);
}

void productOfFloats(const MatrixProduct<float>& job) { product(job); }
void productOfDoubles(const MatrixProduct<double>& job) { product(job); }
void scalarProductsOfFloats(const ScalarProducts<float>& job) { scalarProducts(job); }
void scalarProductsOfDoubles(const ScalarProducts<double>& job) { scalarProducts(job); }

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect {

HWY_EXPORT(productOfFloats);
void multiply(const MatrixProduct<float>& job) { HWY_DYNAMIC_DISPATCH(productOfFloats)(job); }
HWY_EXPORT(productOfDoubles);
void multiply(const MatrixProduct<double>& job) { HWY_DYNAMIC_DISPATCH(productOfDoubles)(job); }

HWY_EXPORT(scalarProductsOfFloats);
void multiply(const ScalarProducts<float>& job) { HWY_DYNAMIC_DISPATCH(scalarProductsOfFloats)(job); }
HWY_EXPORT(scalarProductsOfDoubles);
void multiply(const ScalarProducts<double>& job) { HWY_DYNAMIC_DISPATCH(scalarProductsOfDoubles)(job); }

} // namespace surflect
#endif
