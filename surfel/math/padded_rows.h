// Row-major matrix with rows padded to eight numbers, as matrix_products.h requires.
#pragma once

#include <algorithm>
#include <cstddef>
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

} // namespace surflect
