// Symbols: T the matrix, a its diagonal, b its subdiagonal; Z its eigenvectors, one per row.
#include "surfel/math/tridiagonal.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace surflect {

namespace {

// Rotates two rows of padded length.
template <class Real> void rotate(Real* upper, Real* lower, size_t length, Real c, Real s) {
  for (size_t j = 0; j < length; j += 8) { // eight loads before eight stores
    std::array<Real, 8> u, l;
    std::copy_n(upper + j, 8, u.data());
    std::copy_n(lower + j, 8, l.data());
    for (size_t i = 0; i < 8; ++i) upper[j + i] = c * u[i] + s * l[i];
    for (size_t i = 0; i < 8; ++i) lower[j + i] = c * l[i] - s * u[i];
  }
}

// One QR step: T becomes G T G' and Z becomes G Z, where G is a product of rotations of neighbouring rows
// from `first` to `last`.
template <class Real>
void step(std::vector<Real>& a, std::vector<Real>& b, size_t first, size_t last, PaddedRows<Real>& z) {
  const Real half = (a[last - 1] - a[last]) / 2, end = b[last - 1];
  const Real reach = half + std::copysign(std::sqrt(half * half + end * end), half);
  const Real shift = a[last] - (reach != 0 ? end * end / reach : 0);
  Real x = a[first] - shift, y = b[first];
  for (size_t k = first; k < last; ++k) {
    const Real length = std::sqrt(x * x + y * y);
    const Real inverse = length > 0 ? 1 / length : 0;
    const Real c = length > 0 ? x * inverse : 1, s = y * inverse;
    if (k > first) b[k - 1] = length;
    const Real across = 2 * c * s * b[k] - s * s * (a[k] - a[k + 1]); // moves from a[k] to a[k + 1]
    const Real beside = (c * c - s * s) * b[k] - c * s * (a[k] - a[k + 1]);
    a[k] += across;
    a[k + 1] -= across;
    b[k] = x = beside;
    if (k + 1 < last) {
      y = s * b[k + 1];
      b[k + 1] *= c;
    }
    rotate(z.row(k), z.row(k + 1), z.stride(), c, s);
  }
}

} // namespace

template <class Real>
TridiagonalSpectrum<Real> tridiagonalSpectrum(std::span<const Real> diagonal, std::span<const Real> beside) {
  assert(!diagonal.empty() && beside.size() + 1 == diagonal.size());
  const size_t size = diagonal.size();
  std::vector<Real> a(diagonal.begin(), diagonal.end()), b(beside.begin(), beside.end());
  PaddedRows<Real> z(size, size);
  for (size_t i = 0; i < size; ++i) {
    std::fill_n(z.row(i), size, Real{0});
    z.row(i)[i] = 1;
  }
  Real largest = 0;
  for (const Real value : a) largest = std::max(largest, std::abs(value));
  for (const Real value : b) largest = std::max(largest, std::abs(value));
  const Real negligible = largest * std::numeric_limits<Real>::epsilon() / 2;

  constexpr size_t kSteps = 30; // limit for one value; two are usual
  size_t last = size - 1;
  for (size_t steps = kSteps * size; last > 0 && steps > 0;) {
    if (!(std::abs(b[last - 1]) > negligible)) {
      --last;
      continue;
    }
    size_t first = last - 1;
    while (first > 0 && std::abs(b[first - 1]) > negligible) --first;
    step(a, b, first, last, z);
    --steps;
  }

  std::vector<size_t> order(size);
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, [&](size_t i, size_t j) { return a[i] > a[j]; });
  TridiagonalSpectrum<Real> spectrum{std::vector<Real>(size), PaddedRows<Real>(size, size)};
  for (size_t k = 0; k < size; ++k) {
    spectrum.values[k] = a[order[k]];
    std::copy_n(z.row(order[k]), size, spectrum.vectors.row(k));
  }
  return spectrum;
}

template TridiagonalSpectrum<float> tridiagonalSpectrum(std::span<const float>, std::span<const float>);
template TridiagonalSpectrum<double> tridiagonalSpectrum(std::span<const double>, std::span<const double>);

} // namespace surflect
