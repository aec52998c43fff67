// Predicted error of a picture: how far each pixel may be from what a camera would see, estimated from the
// picture and its photographs alone.
//
//   e^2 = a |c - c_n|^2 + b V(c) + g p |c|^2
//
// Symbols, at a pixel: e RMS error over the three channels; |c|^2 mean square of the channels of the colour;
// c_n colour if each surfel showed its nearest photograph alone, far from c where photographs disagree; V(c)
// variance of c over the 3 x 3 pixels around, large where structure may be blurred or out of place; p view
// gap, from 0 where a camera met the viewing direction to 1 where none within 90 degrees saw the surfel. All
// terms are variances in units of the picture squared: a picture twice as bright has twice the error.
//
// The form is that of independent sources of error, whose variances add. Coefficients are at least 0, so e
// grows with each term.
#pragma once

#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <span>
#include <vector>

namespace surflect::surfels {

struct ErrorModel {
  double disagreement = 1, structure = 1, gap = 1; // a, b, g
};

// p of surfels from the confidence in their best view (weights::confidenceOf).
std::vector<float> viewGaps(std::span<const float> confidence);

// e of each pixel. color and nearest: c and c_n, RGBA, premultiplied; gap: p, premultiplied, one channel. All
// have one size. `kept` donates its memory. Throws Cancelled.
image::Image predictedError(const image::Image& color, const image::Image& nearest, const image::Image& gap,
                            const ErrorModel& model, image::Image kept = {}, const Progress& progress = {});

// The error model of the AOV predicted_error, fitted to path-traced stages.

// Set by `scripts/confidence fit`; docs/stability.md says how well it predicts the errors of other objects.
inline constexpr ErrorModel kFittedErrorModel{.disagreement = 0.19, .structure = 0.32, .gap = 0.27};

} // namespace surflect::surfels
