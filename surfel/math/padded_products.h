// Copies, transposes and products of padded matrices.
#pragma once

#include "surfel/math/matrix_products.h"
#include "surfel/math/padded_rows.h"
#include "surfel/math/transpose.h"

#include <algorithm>

namespace surflect {

template <class Real> PaddedRows<Real> copied(const PaddedRows<Real>& a) {
  PaddedRows<Real> result(a.rows(), a.columns());
  if (a.rows() > 0) std::copy_n(a.row(0), a.rows() * a.stride(), result.row(0));
  return result;
}

// A'
template <class Real> PaddedRows<Real> transposed(const PaddedRows<Real>& a) {
  PaddedRows<Real> result(a.columns(), a.rows());
  transpose(a.row(0), a.stride(), a.rows(), a.columns(), result.row(0), result.stride());
  return result;
}

// A B
template <class Real> PaddedRows<Real> product(const PaddedRows<Real>& a, const PaddedRows<Real>& b) {
  PaddedRows<Real> c(a.rows(), b.columns());
  multiply(MatrixProduct<Real>{a.row(0), a.stride(), 1, b.row(0), b.stride(), c.row(0), c.stride(), a.rows(),
                               a.columns(), b.stride(), false});
  return c;
}

// A' B, in panels of rows that stay in the cache.
template <class Real> PaddedRows<Real> innerProducts(const PaddedRows<Real>& a, const PaddedRows<Real>& b) {
  constexpr size_t kPanel = 32;
  PaddedRows<Real> c(a.columns(), b.columns());
  for (size_t first = 0; first < a.rows(); first += kPanel)
    multiply(MatrixProduct<Real>{a.row(first), 1, a.stride(), b.row(first), b.stride(), c.row(0), c.stride(),
                                 a.columns(), std::min(kPanel, a.rows() - first), b.stride(), false,
                                 first > 0});
  return c;
}

} // namespace surflect
