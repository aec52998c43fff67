#include "warp/lattice.h"

#include "warp/deform_kernels.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::warp {

namespace {

// Bernstein polynomials of one degree and their derivatives at one point.
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

// Bernstein polynomials as powers of x in -half..half: entry (k, i) is the factor of x^k in B_i^n((1 + x /
// half) / 2), where
//   B_i^n((1 + s) / 2) = C(n, i) (1 + s)^i (1 - s)^(n - i) / 2^n
Eigen::MatrixXd powersOfBernstein(int n, double half) {
  Eigen::MatrixXd powers = Eigen::MatrixXd::Zero(n + 1, n + 1);
  double binomial = 1; // C(n, i)
  for (int i = 0; i <= n; ++i) {
    auto column = powers.col(i);
    column[0] = std::ldexp(binomial, -n);
    for (int factor = 0; factor < n; ++factor)
      for (int k = factor + 1; k > 0; --k) column[k] += factor < i ? column[k - 1] : -column[k - 1];
    binomial *= double(n - i) / (i + 1);
  }
  for (int k = 0; k <= n; ++k) powers.row(k) *= std::pow(half, -k);
  return powers;
}

// Returns whether the displacement can be summed by powers. They lose digits, because their factors are up to
// 2^degrees as large as the moves: with 24 degrees over all axes the error is 2e-9 of the largest move. A
// move divided by one power of each half side, all below 2^256, must also fit into a double.
bool hasPowers(const std::array<int, 3>& divisions, const Vec3<double>& half) {
  bool hold = true;
  for (int axis = 0; axis < 3; ++axis) hold &= std::abs(divisions[axis] * std::log2(half[axis])) < 256;
  return hold && divisions[0] + divisions[1] + divisions[2] <= 24;
}

// Displacement as powers of the position relative to the box's middle, for LatticeStep.
std::vector<Vec3<double>> powerCoefficients(const Lattice& lattice, const Vec3<double>& half) {
  const auto [l, m, n] = lattice.divisions;
  const Eigen::MatrixXd overX = powersOfBernstein(l, half.x()), overY = powersOfBernstein(m, half.y()),
                        overZ = powersOfBernstein(n, half.z());
  // One axis after the other; each array holds powers along summed axes and control points along the others.
  std::vector<Vec3<double>> from = lattice.moves, to;
  const auto sumOver = [&](const Eigen::MatrixXd& powers, int axis) {
    to.assign(from.size(), Vec3<double>::Zero());
    for (int k = 0; k <= n; ++k)
      for (int j = 0; j <= m; ++j)
        for (int i = 0; i <= l; ++i) {
          std::array power{i, j, k};
          const Vec3<double>& point = from[lattice.pointIndex({i, j, k})];
          for (power[axis] = 0; power[axis] < powers.rows(); ++power[axis])
            to[lattice.pointIndex(power)] += powers(power[axis], std::array{i, j, k}[axis]) * point;
        }
    from.swap(to);
  };
  sumOver(overX, 0);
  sumOver(overY, 1);
  sumOver(overZ, 2);
  std::ranges::reverse(from);
  return from;
}

class FreeForm final : public Warp {
public:
  explicit FreeForm(Lattice lattice)
      : lattice_(std::move(lattice)), middle_((lattice_.least + lattice_.most) / 2),
        half_((lattice_.most - lattice_.least) / 2) {
    if (hasPowers(lattice_.divisions, half_)) powers_ = powerCoefficients(lattice_, half_);
  }

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
    Mat3<double> gradient = Mat3<double>::Zero(); // of the displacement with respect to s, t, u
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

  void carry(WarpBatch& batch) const override {
    if (powers_.empty())
      Warp::carry(batch);
    else
      carryLattice({middle_.data(), half_.data(), lattice_.divisions.data(), powers_.front().data()}, batch);
  }

private:
  std::array<Basis, 3> basesAt(const Vec3<double>& x) const {
    const Vec3<double> place = (x - lattice_.least).cwiseQuotient(lattice_.most - lattice_.least);
    return {bernstein(lattice_.divisions[0], place[0]), bernstein(lattice_.divisions[1], place[1]),
            bernstein(lattice_.divisions[2], place[2])};
  }

  Lattice lattice_;
  Vec3<double> middle_, half_;       // centre of the box, and half its size
  std::vector<Vec3<double>> powers_; // powerCoefficients; empty unless hasPowers
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

} // namespace surflect::warp
