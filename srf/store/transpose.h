// Rows of a matrix written as columns.
#pragma once

#include <cstddef>
#include <cstring>

namespace surflect {

// Four rows of four.
template <class Real> inline void transposeFour(const Real* from, size_t fromRow, Real* to, size_t toRow) {
  for (size_t i = 0; i < 4; ++i)
    for (size_t j = 0; j < 4; ++j) to[j * toRow + i] = from[i * fromRow + j];
}

template <> inline void transposeFour(const float* from, size_t fromRow, float* to, size_t toRow) {
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

// to[j][i] = from[i][j], of `rows` times `columns` numbers in rows that are so far apart.
template <class Real>
void transpose(const Real* from, size_t fromRow, size_t rows, size_t columns, Real* to, size_t toRow) {
  const size_t wholeRows = rows / 4 * 4, wholeColumns = columns / 4 * 4;
  for (size_t j = 0; j < wholeColumns; j += 4) // what is written stays in the cache
    for (size_t i = 0; i < wholeRows; i += 4)
      transposeFour(from + i * fromRow + j, fromRow, to + j * toRow + i, toRow);
  for (size_t i = 0; i < rows; ++i)
    for (size_t j = i < wholeRows ? wholeColumns : 0; j < columns; ++j)
      to[j * toRow + i] = from[i * fromRow + j];
}

} // namespace surflect
