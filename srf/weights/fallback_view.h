// Fallback views: views that do not see a surfel, blended if no view sees it well. They continue a surface
// beyond its photographed part without a jump, and never turn it black. Not in the papers.
//
//   p' = min(p / s, (p + d) / (e b g))
//
// Symbols: p' penalty of a view in whose image the surfel projects; p = 1 - cos of the view's angle to the
// requested direction; s the view's visibility weight at the surfel (visibility_weights.h), b the factor of s
// that falls towards the image's border. g favours views near the horizon: it is 1 where the surfel is just
// turning away, falls as the surfel turns further, and is below 1 for a surfel that faces the view but is
// hidden. d and e are constants; e is large enough for a gradual change as s falls to 0.
#pragma once

#include "srf/weights/fades.h"

#include <algorithm>
#include <cmath>

namespace surflect::weights {

inline constexpr float kFallbackFade = 1 / 3.f;      // e
inline constexpr float kFallbackOffset = 2 / 3.f;    // d > 0: a fallback never takes the whole weight
inline constexpr double kFallbackTurn = 0.1;         // cosine at which g has fallen to 37 %
inline constexpr double kFallbackHidden = 1 / 200.0; // least g of a view that faces the surfel

// Fallbacks have no weight if the best view's penalty is at most this. With the penalty l >= 0 of a light
// added, a fallback's penalty is at least (d + l) / e; the threshold of the blend is at most 2 (1 + l), which
// is no larger.
inline constexpr float kFallbackFrom = 1;
static_assert(kFallbackOffset / kFallbackFade >= 2);

// Factor 1 / (e b g) of a fallback's penalty.
inline float fallbackScale(double cosine, double border, double fade) {
  const double open = fade > 0 ? std::min(1.0, fade / (grazingFade(cosine) * border)) : 0;
  const double falling = std::exp(-std::abs(cosine) / kFallbackTurn);
  const double g = cosine > 0 ? open + (1 - open) * std::max(falling, kFallbackHidden) : falling;
  return static_cast<float>(1 / (kFallbackFade * border * g));
}

inline float fallbackPenalty(float penalty, float scale) { return (penalty + kFallbackOffset) * scale; }

// Confidence in a fallback of this angle and penalty, 0..1 (srf/weights/pair_weights.h).
inline float fallbackConfidence(float angle, float penalty) {
  return std::min(1.f, (angle + kFallbackOffset) / (penalty + kFallbackOffset));
}

// Lower bound on the penalty of a fallback, cheap to compute, from a penalty and a cosine with errors up to
// `rounding`. Uses b <= 1 and exp(-t) <= 1 / (1 + t + t^2 / 2), and g <= 1 where the view may see the surfel.
inline float leastFallbackPenalty(float penalty, float cosine, bool isOpen, float rounding) {
  const float t = std::max(0.f, std::abs(cosine) - rounding) / static_cast<float>(kFallbackTurn);
  const float inverse = std::min(1 + t * (1 + t / 2), static_cast<float>(1 / kFallbackHidden));
  const bool mayBeOpen = isOpen && cosine > -rounding;
  return fallbackPenalty(penalty - rounding, 0.999f / kFallbackFade * (mayBeOpen ? 1 : inverse));
}

} // namespace surflect::weights
