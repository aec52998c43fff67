// Which pixels show the object, where photographs come without masks and before a dark background.
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"

#include <span>

namespace surflect::calibration {

// Object pixels of one view from all its photographs (at least one; 1 or 3 channels, linear, one size), in
// three steps:
//
//   1. pixels whose luminance, the largest of all photographs, is above threshold times the 99.5th percentile
//      of that of all pixels;
//   2. of those the largest group (of 8-neighbours), and every group of at least a tenth of its pixels;
//   3. and holes: groups (of 4-neighbours) of other pixels that neither touch the image's border nor have
//      a tenth of the largest group's pixels. Gaps stay open: holes of at least a hundredth of its pixels
//      whose median luminance is below 0.18 of the threshold's, as in no shadow on an object.
//
// Throws Error for photographs of different sizes.
image::Mask objectByThreshold(std::span<const image::Image> photographs, double threshold);

} // namespace surflect::calibration
