// Symbols: G the Gram matrix, n x n; Q the Lanczos vectors, orthonormal; T = Q' G Q, tridiagonal: alpha,
// beta.
#include "srf/store/block_spectrum.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace surflect {

namespace {

constexpr double kMissed = 0.01;   // of what is tolerated, by vectors that are not quite eigenvectors
constexpr Eigen::Index kSpare = 2; // vectors, and a quarter of those needed
// Lanczos vectors before the first look at what they make; from look to look half as many more.
constexpr Eigen::Index kFirst = 12;

// Directions that no block has reason to be orthogonal to.
template <class Real> Eigen::VectorX<Real> anyDirection(Eigen::Index size, uint32_t& state) {
  return Eigen::VectorX<Real>::NullaryExpr(size, [&] {
    state = state * 1664525 + 1013904223;
    return static_cast<Real>(state >> 8) / (1 << 23) - 1;
  });
}

template <class Real> struct Ritz {
  Eigen::VectorX<Real> values;  // falling
  Eigen::MatrixX<Real> vectors; // in the basis Q
};

template <class Real> Ritz<Real> ritzOf(const std::vector<Real>& alpha, const std::vector<Real>& beta) {
  const auto size = static_cast<Eigen::Index>(alpha.size());
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixX<Real>> solver;
  solver.computeFromTridiagonal(Eigen::Map<const Eigen::VectorX<Real>>(alpha.data(), size),
                                Eigen::Map<const Eigen::VectorX<Real>>(beta.data(), size - 1));
  return {solver.eigenvalues().reverse(), solver.eigenvectors().rowwise().reverse()};
}

// How many vectors leave at most `tolerated`, and some to spare; none where that takes more than half of what
// there is, or where vectors miss too much. What a vector v = Q s with value theta misses is at most |G v -
// theta v|^2 / (theta - the strongest left out), and |G v - theta v| = beta |last of s|.
template <class Real> size_t enough(const Ritz<Real>& ritz, double trace, Real beta, double tolerated) {
  const Eigen::Index size = ritz.values.size();
  Eigen::Index terms = 0;
  for (double left = trace; left > tolerated; ++terms) {
    if (terms == size / 2) return 0;
    left -= static_cast<double>(ritz.values[terms]);
  }
  const Eigen::Index all = std::min(terms + terms / 4 + kSpare, size - 1);
  double missed = 0;
  for (Eigen::Index k = 0; k < terms; ++k) {
    const Real residual = beta * ritz.vectors(size - 1, k);
    missed += static_cast<double>(residual * residual / (ritz.values[k] - ritz.values[all]));
  }
  return missed <= kMissed * tolerated ? static_cast<size_t>(all) : 0;
}

} // namespace

template <class Real> Spectrum<Real> strongestVectors(const PaddedRows<Real>& gram, Real tolerated) {
  using RowMajor = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Vector = Eigen::VectorX<Real>;
  const auto n = static_cast<Eigen::Index>(gram.rows());
  const Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>> g(
      gram.row(0), n, n, Eigen::OuterStride<>(static_cast<Eigen::Index>(gram.stride())));
  const double trace = g.diagonal().template cast<double>().sum();
  const double lost = trace * std::numeric_limits<Real>::epsilon(); // in rounding

  Eigen::MatrixX<Real> q(n, n);
  const auto orthogonal = [&](Vector v, Eigen::Index size) {
    const auto before = q.leftCols(size);
    for (int pass = 0; pass < 2; ++pass)
      v -= before * (before.transpose() * v); // twice is enough [Parlett 1980]
    return v;
  };
  std::vector<Real> alpha, beta;
  uint32_t state = 1;
  Vector next = g * anyDirection<Real>(n, state);
  Ritz<Real> ritz;
  size_t terms = 0;
  double left = trace;
  Eigen::Index look = kFirst;
  for (Eigen::Index size = 0;; ++size) {
    next = orthogonal(std::move(next), size);
    Real length = next.norm();
    if (!(static_cast<double>(length) > lost)) { // these are all that the first one leads to
      length = 0;
      next = orthogonal(anyDirection<Real>(n, state), size);
    }
    if (size == n || (size > 0 && left <= lost)) {
      ritz = ritzOf(alpha, beta);
      terms = static_cast<size_t>((ritz.values.array() > static_cast<Real>(lost)).count());
      break;
    }
    if (size >= look && left <= tolerated) {
      look = size + size / 2;
      ritz = ritzOf(alpha, beta);
      terms = enough(ritz, trace, length, tolerated);
      if (terms > 0) break;
    }
    if (size > 0) beta.push_back(length);
    q.col(size) = next.normalized();
    next = g * q.col(size);
    alpha.push_back(q.col(size).dot(next));
    left -= static_cast<double>(alpha.back());
  }

  Spectrum<Real> spectrum{PaddedRows<Real>(gram.rows(), terms)};
  const auto used = static_cast<Eigen::Index>(terms);
  Eigen::Map<RowMajor, 0, Eigen::OuterStride<>>(
      spectrum.vectors.row(0), n, used,
      Eigen::OuterStride<>(static_cast<Eigen::Index>(spectrum.vectors.stride()))) =
      q.leftCols(ritz.vectors.rows()) * ritz.vectors.leftCols(used);
  return spectrum;
}

template Spectrum<float> strongestVectors(const PaddedRows<float>&, float);
template Spectrum<double> strongestVectors(const PaddedRows<double>&, double);

} // namespace surflect
