// Correction of a table's answer by the surfel's own photographs: the weighted sum of their relative
// residuals, measured minus tabulated.
//
//   L = t + s sum_i w_i (X_i - t_i) / s_i,   s = 0.05 white max(c, 0.15) + mean(t)
//     = sum_i f_i X_i + b,                   f_i = min(s / s_i, 4) w_i,   b = t - sum_i f_i t_i
//
// Symbols: t reflectance of the query by its table, with gain; X_i photographs, t_i their reflectance by the
// table, w_i their weights; s scale of the error to expect, with the mean of the channels of t, and c the
// cosine of the light; s_i that of photograph i; white the reflectance of a white pixel. The weights are
// those of simple kriging [Rasmussen 2006, Eq. 2.25]: their sum falls from 1 to 0 with the distance from all
// photographs, so that far away the table answers alone.
//
// The answer is linear in the photographs: factors f_i replace the weights w_i, and a colour b is added.
//
// [Rasmussen 2006] Rasmussen, Williams: Gaussian Processes for Machine Learning.
#pragma once

#include "surfel/math/rgb.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <span>

namespace surflect::reflectance {

// Scale s of the error to expect.
inline float errorScale(const Rgb& predicted, float cosine, float white) {
  constexpr float kDark = 0.05f, kLeastLightCosine = 0.15f;
  return kDark * white * std::max(cosine, kLeastLightCosine) + (predicted.r + predicted.g + predicted.b) / 3;
}

// Largest factor by which a residual grows: what a photograph shows beside its table in the dark, such as the
// reflection of another part, would else sparkle in a highlight.
inline constexpr float kMostScaled = 4;

// A reflectance by a table, not below 0, and the cosine of its light.
struct PredictedReflectance {
  Rgb value;
  float cosine = 1;
};

// Replaces the weights w_i of photographs by the factors f_i, and returns b. Photographs and weights have one
// entry each a photograph.
inline Rgb applyCorrection(const PredictedReflectance& query,
                           std::span<const PredictedReflectance> photographs, float white,
                           std::span<float> weights) {
  assert(weights.size() == photographs.size());
  const float scale = errorScale(query.value, query.cosine, white);
  Rgb sum;
  for (size_t i = 0; i < weights.size(); ++i) {
    weights[i] *=
        std::min(scale / errorScale(photographs[i].value, photographs[i].cosine, white), kMostScaled);
    sum = sum + weights[i] * photographs[i].value;
  }
  return query.value + -1.f * sum;
}

} // namespace surflect::reflectance
