#include "warp/lattice.h"

#include <algorithm>
#include <cassert>

namespace surflect {

namespace {

// The Bernstein polynomials of one degree and their derivatives at one place.
struct Basis {
  std::array<double, mostLatticeDivisions + 1> value, slope;
};

//   B_i^n(s)    = s B_(i-1)^(n-1)(s) + (1 - s) B_i^(n-1)(s)
//   dB_i^n / ds = n (B_(i-1)^(n-1)(s) - B_i^(n-1)(s))
// Beyond 0..1: on along the tangent at the end.
Basis bernstein(int degree, double place) {
  const double s = std::clamp(place, 0.0, 1.0);
  Basis basis;
  basis.value[0] = 1;
  for (int n = 1; n <= degree; ++n) {
    double below = 0; // B_(i-1)^(n-1)
    for (int i = 0; i <= n; ++i) {
      const double here = i < n ? basis.value[i] : 0;
      if (n == degree) basis.slope[i] = n * (below - here);
      basis.value[i] = s * below + (1 - s) * here;
      below = here;
    }
  }
  for (int i = 0; i <= degree; ++i) basis.value[i] += basis.slope[i] * (place - s);
  return basis;
}

class FreeForm final : public Warp {
public:
  explicit FreeForm(Lattice lattice) : lattice_(std::move(lattice)) {}

  Vec3<double> position(const Vec3<double>& x) const override {
    const auto [b, c, d] = basesAt(x);
    const auto [l, m, n] = lattice_.divisions;
    Vec3<double> sum = Vec3<double>::Zero();
    const Vec3<double>* move = lattice_.moves.data();
    for (int k = 0; k <= n; ++k)
      for (int j = 0; j <= m; ++j) {
        Vec3<double> row = Vec3<double>::Zero();
        for (int i = 0; i <= l; ++i) row += b.value[i] * *move++;
        sum += c.value[j] * d.value[k] * row;
      }
    return x + sum;
  }

  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override {
    const auto [b, c, d] = basesAt(x);
    const auto [l, m, n] = lattice_.divisions;
    Mat3<double> gradient = Mat3<double>::Zero(); // of the displacement, over s, t, u
    const Vec3<double>* move = lattice_.moves.data();
    for (int k = 0; k <= n; ++k)
      for (int j = 0; j <= m; ++j) {
        Vec3<double> row = Vec3<double>::Zero(), slope = Vec3<double>::Zero();
        for (int i = 0; i <= l; ++i, ++move) {
          row += b.value[i] * *move;
          slope += b.slope[i] * *move;
        }
        gradient.col(0) += c.value[j] * d.value[k] * slope;
        gradient.col(1) += c.slope[j] * d.value[k] * row;
        gradient.col(2) += c.value[j] * d.slope[k] * row;
      }
    return Mat3<double>::Identity() + gradient * (lattice_.most - lattice_.least).cwiseInverse().asDiagonal();
  }

private:
  std::array<Basis, 3> basesAt(const Vec3<double>& x) const {
    const Vec3<double> place = (x - lattice_.least).cwiseQuotient(lattice_.most - lattice_.least);
    return {bernstein(lattice_.divisions[0], place[0]), bernstein(lattice_.divisions[1], place[1]),
            bernstein(lattice_.divisions[2], place[2])};
  }

  Lattice lattice_;
};

} // namespace

size_t Lattice::pointCount() const {
  size_t count = 1;
  for (const int n : divisions) count *= static_cast<size_t>(n) + 1;
  return count;
}

size_t Lattice::pointIndex(const std::array<int, 3>& point) const {
  const auto [i, j, k] = point;
  return static_cast<size_t>((k * (divisions[1] + 1) + j) * (divisions[0] + 1) + i);
}

WarpPointer latticeWarp(Lattice lattice) {
  assert((lattice.most - lattice.least).minCoeff() > 0 && lattice.moves.size() == lattice.pointCount());
  assert(std::ranges::all_of(lattice.divisions, [](int n) { return n >= 1 && n <= mostLatticeDivisions; }));
  return std::make_unique<FreeForm>(std::move(lattice));
}

} // namespace surflect
