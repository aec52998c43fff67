// Strengths of directional lights, estimated from a Lambert surface of unknown shape and albedo. Input: one
// view, photographed once under each light (#lights images of 1 or 3 channels, linear, one size; #lights unit
// vectors towards the lights). The fit is s_l(p) max(0, b(p) . l_l), with a free vector b at each object
// pixel. Shadows, highlights and clipped samples are rejected by their residuals. Results do not depend on
// the scale of the photographs, and are in the order of the lights.
//
// Functions throw Error if strengths cannot be determined: fewer than four lights (six for gradients), all
// but one in a plane, a flat surface, too few object pixels; and for photographs of different sizes.
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <span>
#include <vector>

namespace surflect::calibration {

// Object masks by threshold, for photographs without masks before a dark background.

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

// Gradient of the logarithm of a light's strength, to the right and down, per picture height.
using StrengthGradient = Vec2<double>;

// Relative strengths at the middle of the pictures, mean 1 per channel. `gradients`: one per light, or empty
// if each light is uniform over the picture. Cost: #lights^2 per pixel, for at most 20,000 pixels, chosen
// evenly.
std::vector<Rgb> lightStrengths(std::span<const image::Image> radiance, const image::Mask& object,
                                std::span<const Direction3<AcquisitionSpace, double>> towards,
                                std::span<const StrengthGradient> gradients = {});

// Gradients of near lamps and narrow beams. A gradient common to all lights cannot be separated from albedo,
// so their mean is 0. Surfaces that are not Lambertian and inexact directions look like gradients too: even
// lights on a rough dome (Oren and Nayar's model, 0.3) give up to 0.3. Cost: ten times that of strengths.
std::vector<StrengthGradient> lightGradients(std::span<const image::Image> radiance,
                                             const image::Mask& object,
                                             std::span<const Direction3<AcquisitionSpace, double>> towards);

} // namespace surflect::calibration
