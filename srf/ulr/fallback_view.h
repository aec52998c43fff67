// Views that do not see a surfel, but are asked where none that sees it well is left: a surface goes on
// beyond what was photographed, continuously, and never black.
//
// A view that sees the surfel has the penalty p / s, with s its fade. Any view that has the surfel's place in
// its image has at most (p + d) / (e b g): b is the fade of its border; g is 1 at the horizon, where the view
// saw the surface end, and falls where the surfel turns away further, or where it faces the view but
// something is before it. e is large enough for stand-ins to take over gradually as s falls to 0.
#pragma once

#include "srf/ulr/visibility_weights.h"

#include <algorithm>
#include <cmath>

namespace surflect::ulr {

inline constexpr float kFallbackFade = 1 / 3.f;   // e
inline constexpr float kFallbackOffset = 2 / 3.f; // d: no ray is met by a view that sees something else there
inline constexpr double kFallbackTurn = 0.1;      // of the cosine, over which g falls
inline constexpr double kFallbackHidden = 1 / 200.0; // the least g of a view that faces the surfel

// Beside a view of less penalty than this no stand-in has weight: with l >= 0 what a light adds, (d + l) / e
// is beyond the threshold of a blend, at most 2 (1 + l).
inline constexpr float kFallbackFrom = 1;
static_assert(kFallbackOffset / kFallbackFade >= 2);

// 1 / (e b g)
inline float fallbackScale(double cosine, double border, double fade) {
  const double open = fade > 0 ? std::min(1.0, fade / (grazingFade(cosine) * border)) : 0;
  const double falling = std::exp(-std::abs(cosine) / kFallbackTurn);
  const double g = cosine > 0 ? open + (1 - open) * std::max(falling, kFallbackHidden) : falling;
  return static_cast<float>(1 / (kFallbackFade * border * g));
}

inline float fallbackPenalty(float penalty, float scale) { return (penalty + kFallbackOffset) * scale; }

// What no stand-in's penalty is below, without border and exponential, where angle and cosine are known but
// for `rounding`: b is at most 1, and exp(-t) <= 1 / (1 + t + t^2 / 2); where the surfel is open to the view,
// g may be 1.
inline float leastFallbackPenalty(float penalty, float cosine, bool isOpen, float rounding) {
  const float t = std::max(0.f, std::abs(cosine) - rounding) / static_cast<float>(kFallbackTurn);
  const float inverse = std::min(1 + t * (1 + t / 2), static_cast<float>(1 / kFallbackHidden));
  const bool mayBeOpen = isOpen && cosine > -rounding;
  return fallbackPenalty(penalty - rounding, 0.999f / kFallbackFade * (mayBeOpen ? 1 : inverse));
}

} // namespace surflect::ulr
