// How large a block's error may be: its weights and bound. docs/format.md states both.
#pragma once

#include <Eigen/Core>

namespace surflect::codec {

// One over the error that may be, in parts of the tolerance, where a block is this bright, root mean square:
// (r^2 + r + 0.01)^-1/2 with r = rms / white. That is the shape of a camera's own noise: below white it
// grows with the root of the light, as what a display with a gamma of 2 shows alike, beyond white with the
// light itself, and in the dark it stays.
double errorWeight(double rms, double white);

// Errors of a block are weighed per light, by how bright the light shows the block, and per channel, by how
// much darker than all three the channel is: a light that shows the block dimly has its say beside a
// highlight, and red has in blue paint, for the script may make them bright.
struct BlockWeights {
  Eigen::Vector3d channels; // root mean square over lights of the channel's errorWeight over the light's
  Eigen::VectorXd lights;   // errorWeight of all channels
};

// What both follow from: the sums of X^2 over so many texels, for each channel and light.
struct BlockSquares {
  Eigen::Matrix3Xd sums;
  Eigen::Index texels = 0;
};

BlockWeights blockWeights(const BlockSquares& squares, double white);

// |V X W|_F^2, with V and W the weights of channels and lights.
double weightedSquares(const BlockSquares& squares, const BlockWeights& weights);

// Of |V (X - X') W|_F: tau |V X W|_F, where a block darker than 0.001 white counts as that bright; but not
// below what 16 bits at full rank reach whatever the block, 2.5e-4 max(V) |X W|_F.
double blockErrorBound(const BlockSquares& squares, const BlockWeights& weights, double tolerance,
                       double white);

// Error bound of the mean of one channel over texels and lights, whatever the tolerance: 0.2 % of that mean,
// where one below 0.001 white counts as that.
double channelMeanBound(double mean, double white);

} // namespace surflect::codec
