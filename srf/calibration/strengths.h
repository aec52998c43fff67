// How strong directional lights were, told from a Lambert surface of unknown shape and albedo: one view,
// photographed once under each of them (#lights images of 1 or 3 channels, linear, one size; #lights unit
// vectors towards them), fitted by s_l(p) max(0, b(p) . l_l) with a free vector b at each object pixel.
// Shadows, highlights and clipped samples are left out by their residuals. Answers do not depend on the scale
// of the photographs, and follow the order of the lights.
//
// Throw Error where strengths cannot be told: fewer than four lights (six, for gradients), or lights in a
// plane but for one; a flat surface; too few object pixels; and for photographs of different sizes.
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <span>
#include <vector>

namespace surflect::calibration {

// How the logarithm of a light's strength rises to the right and down, per picture height.
using StrengthGradient = Vec2<double>;

// Relative strengths in the middle of the pictures, mean 1 in each channel. Gradients: one a light, or none
// where all are even. Cost: #lights^2 for each of at most 20,000 pixels, taken evenly.
std::vector<Rgb> lightStrengths(std::span<const image::Image> radiance, const image::Mask& object,
                                std::span<const Direction3<AcquisitionSpace, double>> towards,
                                std::span<const StrengthGradient> gradients = {});

// Of lamps that stand near, or whose beams have a middle. What all lights have in common cannot be told from
// albedo: the mean is 0. What is no Lambert surface, and directions that are not exact, look like gradients,
// too: of even lights on a rough dome (Oren and Nayar's model, 0.3) up to 0.3. Cost: ten times that of
// strengths.
std::vector<StrengthGradient> lightGradients(std::span<const image::Image> radiance,
                                             const image::Mask& object,
                                             std::span<const Direction3<AcquisitionSpace, double>> towards);

} // namespace surflect::calibration
