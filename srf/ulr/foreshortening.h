// Foreshortening of blended light: the irradiance of a surface falls with the cosine between light and
// normal, and is 0 if the light is behind the surface. Photographs contain the cosines of their own lights. A
// plain blend [Weyrich 2005, §5.2] therefore shows the shadow line of every blended light, instead of a
// single one where the requested light has it.
//
// If cross-validation of the photographs favours it, a blend is multiplied by the cosine of the requested
// light over the mean cosine of the blended ones: the ratio estimator [Cochran 1977, §6.1], with the cosine
// as auxiliary variable. A matte surface is then exact up to the residual e, for any weights, while the ratio
// is at most 2. No single photograph is divided by its cosine, so noise is not amplified.
//
// [Cochran 1977] Cochran: Sampling Techniques, 3rd edition.
// Symbols: n normal, l requested direction, l_i directions of the blended lights, w_i their weights,
//          c(l) = max(0, n . l), times the shadow state of the light where states are used.
#pragma once

#include "srf/ulr/ulr.h"

#include <algorithm>

namespace surflect::ulr {

// c(l)
template <class T>
T foreshortenedCosine(const Normal3<AcquisitionSpace, T>& n, const Direction3<AcquisitionSpace, T>& l) {
  return std::max(T(0), dot(n, l));
}

// (c(l) + e) / (sum w_i c(l_i) + e), for weights that sum to 1. Capped at 2, as surface and normal may
// disagree. e is the irradiance in attached shadow, a thousandth of that at normal incidence.
inline float foreshortening(float asked, float blended) {
  constexpr float kResidual = 1e-3f, kMost = 2;
  return std::min(kMost, (asked + kResidual) / (std::max(0.f, blended) + kResidual));
}

// sum w_i c(l_i) / sum w_i, with c(l_i) in `cosines` for every light; 0 if there are no weights.
template <class Cosines> float blendedCosine(const BlendSet& blend, const Cosines& cosines) {
  float sum = 0, weights = 0;
  for (const auto& [light, weight] : blend) {
    sum += weight * cosines[light];
    weights += weight;
  }
  return weights > 0 ? sum / weights : 0;
}

} // namespace surflect::ulr
