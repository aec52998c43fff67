#include "srf/store/block_bound.h"

#include <algorithm>
#include <cmath>

namespace surflect {

namespace {

// What 16 bits at full rank reach, as part of the norm: half a quantiser step in each of up to 192 rows is
// sqrt(192) / (2 * 32639) = 2.1e-4.
constexpr double kReachable = 2.5e-4;
constexpr double kFaint = 1e-3; // of white: darker blocks may err as if they were that bright

} // namespace

double errorWeight(double rms, double white) {
  constexpr double kDark = 0.01;
  const double r = rms / white;
  return 1 / std::sqrt(r * r + r + kDark);
}

BlockWeights blockWeights(const BlockSquares& squares, double white) {
  const Eigen::Index lights = squares.sums.cols();
  BlockWeights weights{Eigen::Vector3d::Zero(), Eigen::VectorXd(lights)};
  for (Eigen::Index l = 0; l < lights; ++l) {
    const Eigen::Vector3d means = squares.sums.col(l) / static_cast<double>(squares.texels);
    weights.lights[l] = errorWeight(std::sqrt(means.mean()), white);
    for (int c = 0; c < 3; ++c) {
      const double ratio = errorWeight(std::sqrt(means[c]), white) / weights.lights[l];
      weights.channels[c] += ratio * ratio;
    }
  }
  weights.channels = (weights.channels / static_cast<double>(lights)).cwiseSqrt();
  return weights;
}

double weightedSquares(const BlockSquares& squares, const BlockWeights& weights) {
  return weights.channels.cwiseAbs2().dot(squares.sums * weights.lights.cwiseAbs2());
}

double blockErrorBound(const BlockSquares& squares, const BlockWeights& weights, double tolerance,
                       double white) {
  const auto values = static_cast<double>(3 * squares.texels * squares.sums.cols());
  const double floor = kFaint * white * errorWeight(kFaint * white, white) * std::sqrt(values);
  const BlockWeights alike{Eigen::Vector3d::Constant(weights.channels.maxCoeff()), weights.lights};
  return std::max(tolerance * std::max(std::sqrt(weightedSquares(squares, weights)), floor),
                  kReachable * std::sqrt(weightedSquares(squares, alike)));
}

} // namespace surflect
