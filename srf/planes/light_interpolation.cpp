#include "srf/planes/light_interpolation.h"

#include <Eigen/QR>

#include <cassert>
#include <cmath>

namespace surflect::planes {

namespace {

constexpr Eigen::Index kPolynomials = 3;

// phi(r) [Duchon 1977]
double thinPlate(const Vec3<double>& a, const Vec3<double>& b) {
  const double r = std::hypot(a.x() - b.x(), a.y() - b.y());
  return r > 0 ? r * r * std::log(r) : 0;
}

} // namespace

LightInterpolation::LightInterpolation(std::span<const Vec3<double>> towardsLights)
    : lights_(towardsLights.begin(), towardsLights.end()) {
  assert(!lights_.empty());
  const auto count = static_cast<Eigen::Index>(lights_.size());
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(count + kPolynomials, count + kPolynomials);
  for (Eigen::Index l = 0; l < count; ++l) {
    const Eigen::VectorXd row = features(lights_[static_cast<size_t>(l)]);
    system.row(l) = row.transpose();
    system.col(l).tail(kPolynomials) = row.tail(kPolynomials);
  }
  system.leftCols(count).bottomRows(kPolynomials) = system.topRows(count).rightCols(kPolynomials).transpose();
  // The least solution where equal or coplanar directions leave several.
  const Eigen::MatrixXd inverse =
      Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(system).pseudoInverse();
  weightsFromFeatures_ = inverse.leftCols(count).transpose();
}

Eigen::VectorXd LightInterpolation::features(const Vec3<double>& towards) const {
  const auto count = static_cast<Eigen::Index>(lights_.size());
  Eigen::VectorXd g(count + kPolynomials);
  for (Eigen::Index l = 0; l < count; ++l) g[l] = thinPlate(towards, lights_[static_cast<size_t>(l)]);
  g.tail<kPolynomials>() << 1, towards.x(), towards.y();
  return g;
}

} // namespace surflect::planes
