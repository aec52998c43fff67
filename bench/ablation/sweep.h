// How a picture follows a light that moves in even steps.
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"

#include <span>

namespace surflect::bench {

// Of values along a sweep: a slope that changes by s a step has a second difference of s times the step.
struct SecondDifferences {
  double rms = 0, largest = 0;
};

// L(i-1) - 2 L(i) + L(i+1) of the first three channels at the pixels of the mask, over all of a sweep's
// pictures but the first and last; `white` is 1. At least three pictures, of one size.
SecondDifferences secondDifferences(std::span<const image::Image> pictures, const image::Mask& mask,
                                    double white);

} // namespace surflect::bench
