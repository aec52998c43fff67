#include "surfel/math/truncated_svd.h"

#include "surfel/math/matrix_products.h"
#include "surfel/math/padded_rows.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace surflect {

// Lanczos iteration with full reorthogonalisation [Lanczos 1950].
//
// Symbols: G the Gram matrix, n x n; Q the Lanczos vectors, orthonormal; T = Q' G Q, tridiagonal with
//          diagonal alpha and subdiagonal beta; theta and s an eigenvalue and eigenvector of T.
namespace {

constexpr double kMissed = 0.01; // part of the tolerance that inexact eigenvectors may miss
constexpr size_t kSpare = 2;     // more vectors than needed
// Size of T when it is decomposed for the first time. It is decomposed again whenever it has grown by half.
constexpr size_t kFirst = 12;

// sum = weights' M, over the first `rows` rows of M.
template <class Real> void combine(const Real* weights, const PaddedRows<Real>& m, size_t rows, Real* sum) {
  multiply(MatrixProduct<Real>{weights, rows, 1, m.row(0), m.stride(), sum, m.stride(), 1, rows, m.stride(),
                               false});
}

// Eigenvalues theta of T, descending, and its eigenvectors s, one per column.
template <class Real> struct Ritz {
  Ritz() = default;
  Ritz(const std::vector<Real>& alpha, const std::vector<Real>& beta) {
    using Numbers = Eigen::Map<const Eigen::VectorX<Real>>;
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixX<Real>> solver;
    solver.computeFromTridiagonal(Numbers(alpha.data(), static_cast<Eigen::Index>(alpha.size())),
                                  Numbers(beta.data(), static_cast<Eigen::Index>(alpha.size()) - 1));
    values = solver.eigenvalues().reverse();
    vectors = solver.eigenvectors().rowwise().reverse();
  }
  Eigen::VectorX<Real> values;
  Eigen::MatrixX<Real> vectors;
};

// Fills v with pseudo-random numbers.
template <class Real> void takeAny(PaddedRows<Real>& v, uint32_t& state) {
  std::generate_n(v.row(0), v.columns(), [&] {
    state = state * 1664525 + 1013904223;
    return static_cast<Real>(state >> 8) / (1 << 23) - 1;
  });
}

// Number of Ritz vectors that leave at most `tolerated` of the trace, plus a few spare ones. 0 if that takes
// more than three quarters of the available vectors, or if the vectors are not yet exact enough. The energy
// that a Ritz vector v = Q s misses is at most |G v - theta v|^2 / (theta - theta of the first vector left
// out), where |G v - theta v| = beta |last of s|.
template <class Real> size_t enough(const Ritz<Real>& ritz, double trace, Real beta, double tolerated) {
  const auto size = static_cast<size_t>(ritz.values.size());
  size_t terms = 0;
  for (double left = trace; left > tolerated; ++terms) {
    if (terms == 3 * size / 4) return 0;
    left -= static_cast<double>(ritz.values[terms]);
  }
  const size_t all = std::min(terms + kSpare, size - 1);
  double missed = 0;
  for (size_t k = 0; k < terms; ++k) {
    const Real residual = beta * ritz.vectors(size - 1, k);
    missed += static_cast<double>(residual * residual / (ritz.values[k] - ritz.values[all]));
  }
  return missed <= kMissed * tolerated ? all : 0;
}

} // namespace

template <class Real> Eigenvectors<Real> dominantEigenvectors(const PaddedRows<Real>& gram, Real tolerated) {
  const size_t n = gram.rows();
  double trace = 0;
  for (size_t i = 0; i < n; ++i) trace += static_cast<double>(gram.row(i)[i]);
  const double lost = trace * std::numeric_limits<Real>::epsilon(); // rounding error

  PaddedRows<Real> q(n, n), next(1, n), sum(1, n); // rows of q are vectors
  std::vector<Real> products(n);
  const auto productsOf = [&](const PaddedRows<Real>& m, size_t rows, const Real* v) {
    multiply(ScalarProducts<Real>{m.row(0), m.stride(), rows, v, m.stride(), products.data()});
    return products.data();
  };
  // Makes `next` orthogonal to the first `size` rows of Q. Returns the length that remains.
  const auto makeOrthogonal = [&](size_t size) {
    for (int pass = 0; pass < 2 && size > 0; ++pass) { // twice is enough [Parlett 1980]
      combine(productsOf(q, size, next.row(0)), q, size, sum.row(0));
      for (size_t i = 0; i < next.stride(); ++i) next.row(0)[i] -= sum.row(0)[i];
    }
    return std::sqrt(*productsOf(next, 1, next.row(0)));
  };
  std::vector<Real> alpha, beta;
  alpha.reserve(n);
  beta.reserve(n);
  uint32_t state = 1;
  takeAny(sum, state);
  combine(sum.row(0), gram, n, next.row(0));
  Ritz<Real> ritz;
  size_t terms = 0;
  double left = trace;
  size_t look = kFirst;
  for (size_t size = 0;; ++size) {
    Real length = makeOrthogonal(size), remains = length;
    if (!(static_cast<double>(length) > lost)) { // the Krylov space is exhausted: restart
      length = 0;
      takeAny(next, state);
      remains = makeOrthogonal(size);
    }
    if (size == n || (size > 0 && left <= lost)) {
      ritz = Ritz<Real>(alpha, beta);
      terms = static_cast<size_t>(
          std::ranges::count_if(ritz.values, [&](Real value) { return static_cast<double>(value) > lost; }));
      break;
    }
    if (size >= look && left <= tolerated) {
      look = size + size / 2;
      ritz = Ritz<Real>(alpha, beta);
      terms = enough(ritz, trace, length, tolerated);
      if (terms > 0) break;
    }
    if (size > 0) beta.push_back(length);
    for (size_t i = 0; i < next.stride(); ++i) q.row(size)[i] = next.row(0)[i] / remains;
    combine(q.row(size), gram, n, next.row(0));
    alpha.push_back(*productsOf(next, 1, q.row(size)));
    left -= static_cast<double>(alpha.back());
  }

  const size_t size = alpha.size();
  PaddedRows<Real> chosen(size, terms);
  for (size_t i = 0; i < size; ++i)
    for (size_t k = 0; k < terms; ++k) chosen.row(i)[k] = ritz.vectors(i, k);
  Eigenvectors<Real> spectrum{PaddedRows<Real>(n, terms), trace};
  multiply(MatrixProduct<Real>{q.row(0), 1, q.stride(), chosen.row(0), chosen.stride(),
                               spectrum.vectors.row(0), spectrum.vectors.stride(), n, size, chosen.stride(),
                               false});
  return spectrum;
}

template Eigenvectors<float> dominantEigenvectors(const PaddedRows<float>&, float);
template Eigenvectors<double> dominantEigenvectors(const PaddedRows<double>&, double);

namespace {

// The Gram matrix M' M.
template <class Real> PaddedRows<Real> gramOf(const PaddedRows<Real>& m) {
  PaddedRows<Real> gram(m.columns(), m.columns());
  multiply(MatrixProduct<Real>{m.row(0), 1, m.stride(), m.row(0), m.stride(), gram.row(0), gram.stride(),
                               gram.rows(), m.rows(), gram.stride(), true});
  constexpr size_t kBlock = 8; // the diagonal 8 x 8 blocks are complete
  for (size_t i = kBlock; i < gram.rows(); i += kBlock)
    transpose(gram.row(0) + i, gram.stride(), i, std::min(kBlock, gram.rows() - i), gram.row(i),
              gram.stride());
  return gram;
}

// M v / |M v| for each column v of `vectors`; appends |M v|^2 to `squaredLengths`.
template <class Real>
PaddedRows<Real> directions(const PaddedRows<Real>& m, const PaddedRows<Real>& vectors,
                            std::vector<double>& squaredLengths) {
  PaddedRows<Real> result = product(m, vectors);
  for (size_t first = 0; first < result.stride(); first += 8) {
    std::array<Real, 8> squares{}, scales;
    for (size_t i = 0; i < result.rows(); ++i)
      for (size_t k = 0; k < 8; ++k) squares[k] += result.row(i)[first + k] * result.row(i)[first + k];
    for (size_t k = 0; k < 8; ++k) scales[k] = squares[k] > 0 ? 1 / std::sqrt(squares[k]) : 0;
    for (size_t i = 0; i < result.rows(); ++i)
      for (size_t k = 0; k < 8; ++k) result.row(i)[first + k] *= scales[k];
    for (size_t k = 0; k < 8 && first + k < result.columns(); ++k)
      squaredLengths.push_back(static_cast<double>(squares[k]));
  }
  return result;
}

} // namespace

template <class Real> TruncatedSvd<Real> truncatedSvd(const PaddedRows<Real>& x, Real tolerated) {
  const bool isNarrow = x.columns() <= x.rows();
  const PaddedRows<Real> turned = isNarrow ? PaddedRows<Real>(0, 0) : transposed(x);
  const PaddedRows<Real>& narrow = isNarrow ? x : turned;
  const PaddedRows<Real> gram = gramOf(narrow);
  Eigenvectors<Real> spectrum = dominantEigenvectors(gram, tolerated);

  std::vector<double> energies;
  PaddedRows<Real> along = directions(narrow, spectrum.vectors, energies);
  if (isNarrow) return {std::move(along), std::move(spectrum.vectors), std::move(energies), spectrum.trace};
  return {std::move(spectrum.vectors), std::move(along), std::move(energies), spectrum.trace};
}

template TruncatedSvd<float> truncatedSvd(const PaddedRows<float>&, float);
template TruncatedSvd<double> truncatedSvd(const PaddedRows<double>&, double);

} // namespace surflect
