// Row-major matrix with rows padded to eight numbers, as matrix_products.h requires.
#pragma once

#include "surfel/math/matrix_products.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>

namespace surflect {

template <class Real> class PaddedRows {
public:
  // Values are uninitialised, except for the padding, which is zero.
  PaddedRows(size_t rows, size_t columns)
      : rows_(rows), columns_(columns), stride_(columns / 8 * 8 + (columns % 8 != 0 ? 8 : 0)),
        values_(std::make_unique_for_overwrite<Real[]>(rows * stride_)) {
    if (columns < stride_) // a constant length, which compiles to stores
      for (size_t i = 0; i < rows; ++i) std::fill_n(row(i) + stride_ - 8, 8, Real{0});
  }

  size_t rows() const { return rows_; }
  size_t columns() const { return columns_; }
  size_t stride() const { return stride_; } // numbers from row to row
  Real* row(size_t i) { return values_.get() + i * stride_; }
  const Real* row(size_t i) const { return values_.get() + i * stride_; }

private:
  size_t rows_, columns_, stride_;
  std::unique_ptr<Real[]> values_;
};

// Transposes matrices of floats, doubles or bytes, tile by tile.

// The tile that is transposed in registers.
template <class Real> struct TransposeTile {
  static constexpr size_t rows = 4, columns = 4;

  static void turn(const Real* from, size_t fromRow, Real* to, size_t toRow) {
    for (size_t i = 0; i < rows; ++i)
      for (size_t j = 0; j < columns; ++j) to[j * toRow + i] = from[i * fromRow + j];
  }
};

template <> struct TransposeTile<float> {
  static constexpr size_t rows = 4, columns = 4;

  static void turn(const float* from, size_t fromRow, float* to, size_t toRow) {
    typedef float Four __attribute__((vector_size(16)));
    Four row[4];
    for (size_t i = 0; i < 4; ++i) std::memcpy(&row[i], from + i * fromRow, sizeof row[i]);
    const Four front02 = __builtin_shufflevector(row[0], row[2], 0, 4, 1, 5);
    const Four front13 = __builtin_shufflevector(row[1], row[3], 0, 4, 1, 5);
    const Four back02 = __builtin_shufflevector(row[0], row[2], 2, 6, 3, 7);
    const Four back13 = __builtin_shufflevector(row[1], row[3], 2, 6, 3, 7);
    const Four column[4] = {__builtin_shufflevector(front02, front13, 0, 4, 1, 5),
                            __builtin_shufflevector(front02, front13, 2, 6, 3, 7),
                            __builtin_shufflevector(back02, back13, 0, 4, 1, 5),
                            __builtin_shufflevector(back02, back13, 2, 6, 3, 7)};
    for (size_t j = 0; j < 4; ++j) std::memcpy(to + j * toRow, &column[j], sizeof column[j]);
  }
};

template <> struct TransposeTile<int8_t> {
  static constexpr size_t rows = 8, columns = 16;

  static void turn(const int8_t* from, size_t fromRow, int8_t* to, size_t toRow) {
    Bytes row[8], next[8];
    for (size_t i = 0; i < 8; ++i) std::memcpy(&row[i], from + i * fromRow, sizeof row[i]);
    mergeHalves(row, next); // rows 0 and 4, 1 and 5, ...
    mergeHalves(next, row); // rows 0, 2, 4, 6
    mergeHalves(row, next); // rows 0 .. 7 of two columns
    for (size_t j = 0; j < 16; ++j)
      std::memcpy(to + j * toRow, reinterpret_cast<const int8_t*>(&next[j / 2]) + j % 2 * 8, 8);
  }

private:
  typedef int8_t Bytes __attribute__((vector_size(16)));

  // Interleaves the bytes of the first four rows with those of the last four.
  static void mergeHalves(const Bytes* from, Bytes* to) {
    for (size_t i = 0; i < 4; ++i) {
      const Bytes a = from[i], b = from[i + 4];
      to[2 * i] = __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
      to[2 * i + 1] =
          __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    }
  }
};

// to[j][i] = from[i][j], for `rows` x `columns` numbers. fromRow and toRow are the strides of rows.
template <class Real>
void transpose(const Real* from, size_t fromRow, size_t rows, size_t columns, Real* to, size_t toRow) {
  using Tile = TransposeTile<Real>;
  const size_t wholeRows = rows / Tile::rows * Tile::rows,
               wholeColumns = columns / Tile::columns * Tile::columns;
  // Column by column, so that the written lines stay in the cache.
  for (size_t j = 0; j < wholeColumns; j += Tile::columns)
    for (size_t i = 0; i < wholeRows; i += Tile::rows)
      Tile::turn(from + i * fromRow + j, fromRow, to + j * toRow + i, toRow);
  for (size_t i = 0; i < rows; ++i)
    for (size_t j = i < wholeRows ? wholeColumns : 0; j < columns; ++j)
      to[j * toRow + i] = from[i * fromRow + j];
}

// Copies, transposes and products of padded matrices.
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
