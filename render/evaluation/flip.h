// FLIP: the difference that people see when two pictures alternate on a screen.
//
// [Andersson 2020] Andersson, Nilsson, Akenine-Moeller, Oskarsson, Aastroem, Fairchild: FLIP: A Difference
//                  Evaluator for Alternating Images. PACM CGIT 3(2). The form for displayable pictures.
#pragma once

#include "render/evaluation/measure.h"
#include "srf/image/image.h"
#include "surfel/math/rgb.h"

namespace surflect::evaluation {

// A screen 0.7 m wide with 3840 pixels, seen from 0.7 m.  [Andersson 2020, §6]
inline constexpr double kPixelsPerDegree = 67;

// FLIP at each pixel, 0..1, one channel. Both images hold linear light in [0, 1] (applyExposure), over black;
// they have the same size, and channels beyond the third are ignored.
image::Image flip(const image::Image& a, const image::Image& b, double pixelsPerDegree = kPixelsPerDegree);

// Mean of a one-channel image over the mask.
PooledMean meanOver(const image::Image& values, const image::Mask& mask);

// Colour of an error in 0..1, sRGB-encoded: from black over purple to light yellow, ever lighter.
Rgb errorColor(double error);

} // namespace surflect::evaluation
