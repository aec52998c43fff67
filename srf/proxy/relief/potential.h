// Over the pixels of a mask, the function whose differences between neighbours come nearest to given ones.
//
// [Horn 1990] B. K. P. Horn: Height and Gradient from Shading, IJCV 5(1): the least-squares problem.
// [Braess 1995] D. Braess: Towards Algebraic Multigrid for Elliptic Problems of Second Order, Computing 55.
#pragma once

#include "srf/image/mask.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <vector>

namespace surflect::relief {

// What is known of a function on the pixels of a mask: its differences to the right-hand and to the lower
// neighbour, each with a weight. Vectors have an entry per pixel, row 0 on top. Weights are not below 0, and
// 0 where a neighbour is off the mask or off the image.
struct Differences {
  image::Mask mask;
  std::vector<double> right, down;
  std::vector<double> rightWeight, downWeight;

  explicit Differences(const image::Mask& where);
};

// Minimises sum_e w_e (f_j - f_i - d_e)^2  [Horn 1990]. Every piece of the mask that is connected by weights
// above 0 has mean 0; off the mask f is 0. Conjugate gradients over multigrid by aggregation of 2x2 pixels
// [Braess 1995], to 1e-9 of the first residual; O(pixels). Throws Cancelled.
std::vector<double> potentialOf(const Differences& differences, const Progress& progress);

} // namespace surflect::relief
