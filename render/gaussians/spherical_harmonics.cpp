#include "render/gaussians/spherical_harmonics.h"

#include <Eigen/Cholesky>

#include <cassert>
#include <cmath>

namespace surflect::gaussians {

namespace {

// Weight of the penalty. At a tenth of it, degrees cancel each other over the hemisphere that is seen, and
// programs that draw only the lower ones show blotches.
constexpr double kLambda = 1e-4;

// Degree l of the j-th harmonic.
int degreeOf(size_t j) { return j < 1 ? 0 : j < 4 ? 1 : j < 9 ? 2 : 3; }

} // namespace

std::array<double, kMostCoefficients> harmonicsAt(const Vec3<double>& d) {
  const double x = d[0], y = d[1], z = d[2], xx = x * x, yy = y * y, zz = z * z;
  const double c = kConstantHarmonic;
  return {c, //
          -std::sqrt(3) * c * y,
          std::sqrt(3) * c * z,
          -std::sqrt(3) * c * x, //
          std::sqrt(15) * c * x * y,
          -std::sqrt(15) * c * y * z,
          std::sqrt(5) / 2 * c * (3 * zz - 1),
          -std::sqrt(15) * c * x * z,
          std::sqrt(15) / 2 * c * (xx - yy), //
          -std::sqrt(35.0 / 8) * c * y * (3 * xx - yy),
          std::sqrt(105) * c * x * y * z,
          -std::sqrt(21.0 / 8) * c * y * (5 * zz - 1),
          std::sqrt(7) / 2 * c * z * (5 * zz - 3),
          -std::sqrt(21.0 / 8) * c * x * (5 * zz - 1),
          std::sqrt(105) / 2 * c * z * (xx - yy),
          -std::sqrt(35.0 / 8) * c * x * (xx - 3 * yy)};
}

Coefficients fitted(std::span<const std::array<double, kMostCoefficients>> harmonics,
                    std::span<const Color> colors, std::span<const double> weights, int degree) {
  assert(degree >= 0 && degree <= kHighestDegree);
  assert(harmonics.size() == colors.size() && colors.size() == weights.size());
  using Matrix =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostCoefficients, kMostCoefficients>;
  using Sides = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMostCoefficients, 3>;
  using Row = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostCoefficients, 1>;
  const auto n = static_cast<Eigen::Index>(coefficientsOf(degree));
  Coefficients coefficients{};
  Matrix normal = Matrix::Zero(n, n);
  Sides sides = Sides::Zero(n, 3);
  double total = 0;
  const Color* base = nullptr; // samples are fitted relative to the first one that counts
  for (size_t k = 0; k < colors.size(); ++k) {
    if (!(weights[k] > 0)) continue;
    if (!base) base = &colors[k];
    const Row y = Eigen::Map<const Row>(harmonics[k].data(), n);
    const Eigen::RowVector3d c(colors[k][0] - (*base)[0], colors[k][1] - (*base)[1],
                               colors[k][2] - (*base)[2]);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(y, weights[k]);
    sides.noalias() += (weights[k] * y) * c;
    total += weights[k];
  }
  if (!base) return coefficients;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double l = degreeOf(static_cast<size_t>(j));
    normal(j, j) += kLambda * total * (l * (l + 1)) * (l * (l + 1));
  }
  const Sides solved = normal.selfadjointView<Eigen::Lower>().ldlt().solve(sides);
  for (Eigen::Index j = 0; j < n; ++j)
    for (size_t channel = 0; channel < 3; ++channel)
      coefficients[static_cast<size_t>(j)][channel] = solved(j, static_cast<Eigen::Index>(channel));
  for (size_t channel = 0; channel < 3; ++channel)
    coefficients[0][channel] += (*base)[channel] / kConstantHarmonic;
  return coefficients;
}

} // namespace surflect::gaussians
