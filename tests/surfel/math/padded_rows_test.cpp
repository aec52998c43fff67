#include "surfel/math/padded_rows.h"

#include <gtest/gtest.h>

#include <vector>

namespace surflect {
namespace {

// Rows are longer than necessary; their padding must stay untouched.
template <class Real> void expectTransposed(size_t rows, size_t columns) {
  const size_t fromRow = columns + 3, toRow = rows + 2;
  std::vector<Real> from(rows * fromRow), to(columns * toRow, Real{-1});
  for (size_t i = 0; i < from.size(); ++i) from[i] = static_cast<Real>(i % 113); // fits a byte
  transpose(from.data(), fromRow, rows, columns, to.data(), toRow);
  for (size_t j = 0; j < columns; ++j)
    for (size_t i = 0; i < toRow; ++i)
      ASSERT_EQ(to[j * toRow + i], i < rows ? from[i * fromRow + j] : Real{-1})
          << rows << " x " << columns << ": " << i << ", " << j;
}

TEST(Transpose, PutsEveryNumberInItsPlace) {
  for (const size_t rows : {1, 3, 4, 8, 9, 60})
    for (const size_t columns : {1, 4, 7, 8, 16, 31, 192}) {
      expectTransposed<float>(rows, columns);
      expectTransposed<double>(rows, columns);
      expectTransposed<int8_t>(rows, columns);
    }
}

} // namespace
} // namespace surflect
