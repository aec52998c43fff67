#include "render/splat/low_pass.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace surflect::splat {

namespace {

using Mat2 = Eigen::Matrix2d;

// Eigenvalues of a symmetric matrix, b12 = b21: half the trace +- the radius of Mohr's circle.
struct Eigenvalues {
  double larger, smaller;
};
Eigenvalues eigenvalues(const Mat2& b) {
  const double half = b.trace() / 2, radius = std::hypot((b(0, 0) - b(1, 1)) / 2, b(0, 1));
  const double larger = half + radius;
  return {larger, larger > 0 ? std::max(0.0, b.determinant()) / larger : 0};
}

} // namespace

Mat2 lowPassDeficit(const Mat2& V, double h) {
  const auto [larger, smaller] = eigenvalues(V);
  const double most = std::max(0.0, h * h - smaller), least = std::max(0.0, h * h - larger);
  if (!(larger > smaller)) return most * Mat2::Identity();
  // P = (V - smaller I) / (larger - smaller) projects onto the long axis.
  const Mat2 P = (V - smaller * Mat2::Identity()) / (larger - smaller);
  return most * Mat2::Identity() + (least - most) * P;
}

LowPassed lowPassed(const Mat2& V, const Vec2<double>& C, double h) {
  const Mat2 D = lowPassDeficit(V, h), filteredV = V + D;
  const Mat2 inverse = filteredV.inverse();
  const double energyKept = std::sqrt(std::max(0.0, V.determinant()) / filteredV.determinant());

  const double k = 1 + h * h / eigenvalues(V).larger;
  const Vec2<double> gradient = (V + h * h / (4 * k) * Mat2::Identity()).inverse() * C;
  const Vec2<double> Dg = D * gradient;
  return {filteredV, inverse, energyKept, inverse * C, std::sqrt(Dg.dot(inverse * Dg))};
}

} // namespace surflect::splat
