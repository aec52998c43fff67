// Weights of captured lights for a new direction: a thin plate over the disc of directions that passes
// through each.
//
// [Duchon 1977] J. Duchon: Splines minimizing rotation-invariant semi-norms in Sobolev spaces.
// [Wendland 2005] H. Wendland: Scattered Data Approximation, Cambridge University Press.
//
//   s(w) = sum_j c_j phi(|w - w_j|) + d . p(w),    s(w_l) = f_l,    sum_j c_j p(w_j) = 0   [Wendland 2005,
//   §8.5]
//
// Symbols: w = (x, y) of the unit direction to the light, x right, y up, z to the camera; w_j captured ones;
// f_l any quantity of the photograph under light l; phi(r) = r^2 ln r, the plate of least bending [Duchon
// 1977]; p = (1, x, y).
//
// s is linear in f: s(w) = sum_l u_l(w) f_l, with u = M g(w) and g(w) = (phi(|w - w_1|), .., 1, x, y).
#pragma once

#include "surfel/math/space.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace surflect::planes {

class LightInterpolation {
public:
  // Unit directions of the captured lights, at least one. Equal directions share their weight. Where all lie
  // on a line of the disc, the slope across it is zero.
  explicit LightInterpolation(std::span<const Vec3<double>> towardsLights);

  // g(w), #lights + 3 numbers.
  Eigen::VectorXd features(const Vec3<double>& towards) const;
  // M, #lights x (#lights + 3).
  const Eigen::MatrixXd& weightsFromFeatures() const { return weightsFromFeatures_; }
  // u(w): one for each light; their sum is 1, and at a captured light its own is 1.
  Eigen::VectorXd weights(const Vec3<double>& towards) const {
    return weightsFromFeatures_ * features(towards);
  }

private:
  std::vector<Vec3<double>> lights_;
  Eigen::MatrixXd weightsFromFeatures_;
};

} // namespace surflect::planes
