#include "srf/codec/block_bound.h"

#include <algorithm>
#include <cmath>

namespace surflect::codec {

namespace {

// Relative error that 16 bits reach at full rank: half a quantiser step in each of up to 192 rows is
// sqrt(192) / (2 * 32639) = 2.1e-4.
constexpr double kReachable = 2.5e-4;
constexpr double kFaint = 1e-3; // part of white; darker blocks get the bound of this brightness

// r^2 + r + 0.01, the inverse square of errorWeight, with r = rms / white; T is a number or an array.
template <class T> T squaredError(const T& r) {
  constexpr double kDark = 0.01;
  return r * r + r + kDark;
}

} // namespace

double errorWeight(double rms, double white) { return 1 / std::sqrt(squaredError(rms / white)); }

BlockWeights blockWeights(const ChannelEnergies& squares, double white) {
  using PerChannel = Eigen::Array3Xd;
  using PerLight = Eigen::Array<double, 1, Eigen::Dynamic>;
  const PerChannel means = squares.sums.array() / static_cast<double>(squares.texels);
  const auto ofChannels = squaredError<PerChannel>(means.sqrt() / white);
  const auto ofLights = squaredError<PerLight>(means.colwise().mean().sqrt() / white);
  const PerChannel ratios = ofChannels.inverse().rowwise() * ofLights;
  return {ratios.rowwise().mean().sqrt().matrix(), ofLights.sqrt().inverse().matrix().transpose()};
}

double weightedSquares(const ChannelEnergies& squares, const BlockWeights& weights) {
  return weights.channels.cwiseAbs2().dot(squares.sums * weights.lights.cwiseAbs2());
}

double blockErrorBound(const ChannelEnergies& squares, const BlockWeights& weights, double tolerance,
                       double white) {
  const auto values = static_cast<double>(3 * squares.texels * squares.sums.cols());
  const double floor = kFaint * white * errorWeight(kFaint * white, white) * std::sqrt(values);
  const BlockWeights alike{Eigen::Vector3d::Constant(weights.channels.maxCoeff()), weights.lights};
  return std::max(tolerance * std::max(std::sqrt(weightedSquares(squares, weights)), floor),
                  kReachable * std::sqrt(weightedSquares(squares, alike)));
}

double channelMeanBound(double mean, double white) {
  constexpr double kOfMean = 2e-3;
  return kOfMean * std::max(std::abs(mean), kFaint * white);
}

} // namespace surflect::codec
