// How strong directional lights were, told from a Lambert surface of unknown shape and albedo.
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/rgb.h"
#include "surfel/space.h"

#include <span>
#include <vector>

namespace surflect {

// Relative strengths of the lights (mean 1 in each channel), of one view photographed once under each of
// them: radiance (#lights images of 1 or 3 channels, linear, one size) fitted by s_l max(0, b(p) . l_l) with
// a free vector b at each object pixel. Shadows, highlights and clipped samples are left out by their
// residuals. The strengths do not depend on the scale of the photographs, and follow the order of the lights.
//
// towards: #lights unit vectors. Cost: #lights^2 for each of at most 20,000 pixels, taken evenly.
//
// Throws Error where strengths cannot be told: fewer than four lights, or lights in a plane but for one; a
// flat surface; too few object pixels; and for photographs of different sizes.
std::vector<Rgb> lightStrengths(std::span<const Image> radiance, const Mask& object,
                                std::span<const Direction3<AcquisitionSpace, double>> towards);

} // namespace surflect
