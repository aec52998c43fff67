// How light on a surface is foreshortened: its irradiance falls with the cosine of its angle to the normal,
// and is nothing from behind. Photographs have the cosines of the lights that they were taken under. Blended
// as they are [Weyrich 2005, §5.2], they show as many shadow lines as there are lights in the blend, and none
// where that of the light asked for would lie.
//
// If cross-validation of the photographs favours it, a blend is therefore multiplied by the cosine asked for
// over the mean of those blended: the ratio estimator [Cochran 1977, §6.1], the cosine being what is known of
// the radiance everywhere. A matte surface comes out but for the residual, whatever the weights, while the
// ratio is at most 2. Nothing is divided by the cosine of a single photograph, so that no noise grows.
//
// [Cochran 1977] Cochran: Sampling Techniques, 3rd edition.
// Symbols: n normal, l the direction asked for, l_i of the blended lights, w_i their weights,
//          c(l) = max(0, n . l).
#pragma once

#include "srf/ulr/ulr.h"

#include <algorithm>

namespace surflect::ulr {

// c(l)
template <class T>
T foreshortenedCosine(const Normal3<AcquisitionSpace, T>& n, const Direction3<AcquisitionSpace, T>& l) {
  return std::max(T(0), dot(n, l));
}

// (c(l) + e) / (sum w_i c(l_i) + e), for weights that sum to 1; at most 2, where surface and normals may
// disagree. e is what light there is in attached shadow: a thousandth of that which falls straight on.
inline float foreshortening(float asked, float blended) {
  constexpr float kResidual = 1e-3f, kMost = 2;
  return std::min(kMost, (asked + kResidual) / (std::max(0.f, blended) + kResidual));
}

// sum w_i c(l_i) / sum w_i, where `cosines` has c(l_i) for every light; 0 for no weights.
template <class Cosines> float blendedCosine(const BlendSet& blend, const Cosines& cosines) {
  float sum = 0, weights = 0;
  for (const auto& [light, weight] : blend) {
    sum += weight * cosines[light];
    weights += weight;
  }
  return weights > 0 ? sum / weights : 0;
}

} // namespace surflect::ulr
