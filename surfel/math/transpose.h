// Transposes matrices of floats, doubles or bytes, tile by tile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace surflect {

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

} // namespace surflect
