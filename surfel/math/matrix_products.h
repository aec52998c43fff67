// Products of matrices, vectorised. Every instruction set gives the same bits: sums run in the order of rows,
// without fused multiply-add.
//
// Matrices are stored row by row; every row is padded with zeros to a multiple of eight numbers (PaddedRows).
#pragma once

#include <cstddef>

namespace surflect {

// C = A B, where A(i, k) = a[i aRow + k aColumn]. If `upper`, C is symmetric and only the 8 x 8 blocks on and
// right of its diagonal are computed. If `isAdded`, the product is added to C.
template <class Real> struct MatrixProduct {
  const Real* a;
  size_t aRow, aColumn;
  const Real* b;
  size_t bRow;
  Real* c;
  size_t cRow;
  size_t rows, inner, columns; // rows of C; length of the inner sum; padded columns of C
  bool upper;
  bool isAdded = false;
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

} // namespace surflect
