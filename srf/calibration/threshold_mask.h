// Object masks by threshold, for photographs without masks before a dark background.
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"

#include <span>

namespace surflect::calibration {

// Object pixels of one view from all its photographs (at least one; 1 or 3 channels, linear, one size), in
// three steps:
//
//   1. Pixels whose largest luminance over all photographs exceeds threshold times its 99.5th percentile over
//      all pixels.
//   2. The largest of their groups (8-neighbours), and every group of at least a tenth of its pixels.
//   3. Holes: groups (4-neighbours) of other pixels that neither touch the image border nor have a tenth of
//      the largest group's pixels. Gaps stay open: holes of at least a hundredth of its pixels whose median
//      luminance is below 0.18 of the threshold's, darker than any shadow on an object.
//
// Throws Error for photographs of different sizes.
image::Mask objectByThreshold(std::span<const image::Image> photographs, double threshold);

} // namespace surflect::calibration
