// Error bound of a block: brightness-dependent weights and the tolerated weighted error. docs/format.md
// states both.
#pragma once

#include <Eigen/Core>

namespace surflect::codec {

// Error weight at a root mean square radiance: (r^2 + r + 0.01)^-1/2 with r = rms / white. The tolerated
// error, its inverse, follows a camera's noise: constant in the dark, proportional to the square root of
// radiance below white (which a display of gamma 2 shows evenly), and proportional to radiance above white.
double errorWeight(double rms, double white);

// Weights of a block's errors: V = diag(channels) repeated for every texel, W = diag(lights). The weight of a
// light rises as it shows the block more dimly, and the weight of a channel as it gets darker than the mean
// of all three. A script may brighten a dim light, or the red in blue paint, so their errors must stay small
// too.
struct BlockWeights {
  Eigen::Vector3d channels; // root mean square over lights of errorWeight(channel) / errorWeight(light)
  Eigen::VectorXd lights;   // errorWeight of the mean of the three channels
};

// Sums of X^2 over `texels` texels, for each channel and light.
struct ChannelEnergies {
  Eigen::Matrix3Xd sums;
  Eigen::Index texels = 0;
};

BlockWeights blockWeights(const ChannelEnergies& squares, double white);

// |V X W|_F^2, with V and W the weights of channels and lights.
double weightedSquares(const ChannelEnergies& squares, const BlockWeights& weights);

// Bound on |V (X - X') W|_F: tau |V X W|_F, where a block darker than 0.001 white counts as that bright.
// Never below 2.5e-4 max(V) |X W|_F, which 16 bits reach at full rank for any block.
double blockErrorBound(const ChannelEnergies& squares, const BlockWeights& weights, double tolerance,
                       double white);

// Bound on the error of a channel's mean over texels and lights: 0.2 % of the mean, or of 0.001 white if the
// mean is smaller. Independent of the tolerance.
double channelMeanBound(double mean, double white);

} // namespace surflect::codec
