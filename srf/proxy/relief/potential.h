// Function over the pixels of a mask whose differences between neighbours are nearest to given ones.
//
// [Horn 1990] B. K. P. Horn: Height and Gradient from Shading, IJCV 5(1): the least-squares problem. [Braess
// 1995] D. Braess: Towards Algebraic Multigrid for Elliptic Problems of Second Order, Computing 55.
#pragma once

#include "srf/image/mask.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <vector>

namespace surflect::relief {

// Differences to the right-hand and the lower neighbour, each with a weight. Vectors have one entry per
// pixel, row 0 on top. Weights are not negative, and 0 if a neighbour is off the mask or off the image.
struct Differences {
  image::Mask mask;
  std::vector<double> right, down;
  std::vector<double> rightWeight, downWeight;

  explicit Differences(const image::Mask& where);
};

// Minimises sum_e w_e (f_j - f_i - d_e)^2  [Horn 1990]. Each piece of the mask that is connected by positive
// weights has mean 0; off the mask f is 0. Conjugate gradients, preconditioned by multigrid over aggregates
// of 2x2 pixels [Braess 1995], to 1e-9 of the first residual; O(pixels). Throws Cancelled.
std::vector<double> potentialOf(const Differences& differences, const Progress& progress);

} // namespace surflect::relief
