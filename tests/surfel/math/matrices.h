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

// Columns are orthonormal, by Gram and Schmidt; Eigen's QR decomposition takes seconds to compile.
inline Eigen::MatrixXd randomOrthogonal(int size, std::mt19937& generator) {
  Eigen::MatrixXd q = randomMatrix(size, size, generator);
  for (int column = 0; column < size; ++column) {
    for (int times = 0; times < 2; ++times) // the second removes what rounding has left
      for (int other = 0; other < column; ++other)
        q.col(column) -= q.col(other).dot(q.col(column)) * q.col(other);
    q.col(column).normalize();
  }
  return q;
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
