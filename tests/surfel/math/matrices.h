// Random matrices, and conversions between Eigen's and padded ones.
#pragma once

#include "surfel/math/padded_rows.h"

#include <Eigen/Core>

#include <algorithm>
#include <random>
#include <vector>

namespace surflect {

inline Eigen::MatrixXd randomMatrix(int rows, int columns, std::mt19937& generator) {
  std::normal_distribution<float> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return double{normal(generator)}; });
}

template <class Real> PaddedRows<Real> noise(size_t rows, size_t columns, std::mt19937& generator) {
  std::normal_distribution<Real> normal;
  PaddedRows<Real> m(rows, columns);
  for (size_t i = 0; i < rows; ++i) std::generate_n(m.row(i), columns, [&] { return normal(generator); });
  return m;
}

template <class Real> std::vector<Real> valuesOf(const PaddedRows<Real>& m) {
  return {m.row(0), m.row(0) + m.rows() * m.stride()};
}

template <class Real> PaddedRows<Real> rowsOf(const Eigen::MatrixXd& m) {
  PaddedRows<Real> rows(m.rows(), m.cols());
  for (size_t i = 0; i < rows.rows(); ++i)
    for (size_t j = 0; j < rows.columns(); ++j) rows.row(i)[j] = static_cast<Real>(m(i, j));
  return rows;
}

template <class Real> Eigen::MatrixXd matrixOf(const PaddedRows<Real>& rows) {
  return Eigen::MatrixXd::NullaryExpr(rows.rows(), rows.columns(),
                                      [&](auto i, auto j) { return double{rows.row(i)[j]}; });
}

} // namespace surflect
