// Symbols: G the Gram matrix, n x n; Q the Lanczos vectors, orthonormal; T = Q' G Q, tridiagonal: alpha, beta.
#include "srf/store/block_spectrum.h"

#include <Eigen/Eigenvalues>

#include <cmath>
#include <limits>
#include <vector>

namespace surflect {

namespace {

constexpr double kMissed = 0.01; // of what is tolerated, by vectors that are not quite eigenvectors
constexpr Eigen::Index kSpare = 2;
constexpr size_t kFirst = 12, kMore = 6; // vectors before the first look at them, and from look to look

// Directions that no block has reason to be orthogonal to.
template <class Real> Eigen::VectorX<Real> anyDirection(Eigen::Index size, uint32_t& state) {
  return Eigen::VectorX<Real>::NullaryExpr(size, [&] {
    state = state * 1664525 + 1013904223;
    return static_cast<Real>(state >> 8) / (1 << 23) - 1;
  });
}

struct Ritz {
  Eigen::VectorXd values;  // falling
  Eigen::MatrixXd vectors; // in the basis Q
};

Ritz ritzOf(const std::vector<double>& alpha, const std::vector<double>& beta) {
  const auto size = static_cast<Eigen::Index>(alpha.size());
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(Eigen::Map<const Eigen::VectorXd>(alpha.data(), size),
                                Eigen::Map<const Eigen::VectorXd>(beta.data(), size - 1));
  return {solver.eigenvalues().reverse(), solver.eigenvectors().rowwise().reverse()};
}

// How many vectors leave at most `tolerated`; none where more are needed than there are, or where some of
// these miss too much: |G v - theta v| = beta |last of s| for v = Q s, and of theta that squared over theta.
size_t enough(const Ritz& ritz, double trace, double beta, double tolerated) {
  const Eigen::Index size = ritz.values.size();
  Eigen::Index terms = 0;
  for (double left = trace; left > tolerated; ++terms) {
    if (terms == size) return 0;
    left -= ritz.values[terms];
  }
  const Eigen::Index all = std::min(terms + terms / 4 + kSpare, size);
  const double next = all < size ? ritz.values[all] : 0;
  double missed = 0;
  for (Eigen::Index k = 0; k < terms; ++k) {
    const double residual = beta * ritz.vectors(ritz.vectors.rows() - 1, k);
    missed += residual * residual / (ritz.values[k] - next);
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

  Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic> q(n, n);
  std::vector<double> alpha, beta;
  uint32_t state = 1;
  Vector next = g * anyDirection<Real>(n, state);
  Ritz ritz;
  size_t terms = 0;
  for (double left = trace;;) {
    const auto size = static_cast<Eigen::Index>(alpha.size());
    const auto before = q.leftCols(size);
    // Twice is enough [Parlett 1980].
    for (int pass = 0; pass < 2; ++pass) next -= before * (before.transpose() * next);
    double length = next.norm();
    const bool invariant = !(length > lost); // what is left is elsewhere
    if (invariant) {
      next = anyDirection<Real>(n, state);
      for (int pass = 0; pass < 2; ++pass) next -= before * (before.transpose() * next);
    }
    if (size > 0) {
      const bool looks = alpha.size() >= kFirst && (alpha.size() - kFirst) % kMore == 0;
      const bool ends = size == n || left <= lost;
      if (ends || (looks && left <= tolerated)) {
        ritz = ritzOf(alpha, beta);
        terms = enough(ritz, trace, ends || invariant ? 0 : length, tolerated);
        const auto sound = static_cast<size_t>((ritz.values.array() > lost).count());
        terms = ends && terms == 0 ? sound : std::min(terms, sound);
        if (ends || terms > 0) break;
      }
      beta.push_back(invariant ? 0 : length);
    }
    q.col(size) = next.normalized();
    next = g * q.col(size);
    alpha.push_back(static_cast<double>(q.col(size).dot(next)));
    left -= alpha.back();
  }

  Spectrum<Real> spectrum{PaddedRows<Real>(gram.rows(), terms)};
  const auto used = static_cast<Eigen::Index>(terms);
  Eigen::Map<RowMajor, 0, Eigen::OuterStride<>>(
      spectrum.vectors.row(0), n, used,
      Eigen::OuterStride<>(static_cast<Eigen::Index>(spectrum.vectors.stride()))) =
      q.leftCols(ritz.vectors.rows()) * ritz.vectors.leftCols(used).template cast<Real>();
  return spectrum;
}

template Spectrum<float> strongestVectors(const PaddedRows<float>&, float);
template Spectrum<double> strongestVectors(const PaddedRows<double>&, double);

} // namespace surflect
