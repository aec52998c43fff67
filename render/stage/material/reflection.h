// Reflection by GGX facets, but for Fresnel's factor.
#pragma once

#include "render/stage/material/ggx.h"

#include <optional>

namespace surflect::material::ggx {

// f cos of facets that reflect everything; wi and wo above.  [Walter 2007, Eq. 20]
inline double reflected(const ShadingDirection& wi, const ShadingDirection& wo, const Roughness& alpha) {
  const ShadingDirection h = normalized(wi + wo);
  return density(h, alpha) * G2(wi, wo, alpha) / (4 * wo.z());
}

// Density of mirrored(wo, visibleNormal(wo)).  [Walter 2007, Eq. 14]
inline double reflectedDensity(const ShadingDirection& wi, const ShadingDirection& wo,
                               const Roughness& alpha) {
  const ShadingDirection h = normalized(wi + wo);
  return G1(wo, alpha) * density(h, alpha) / (4 * wo.z());
}

// reflected / reflectedDensity for wo above and a wi that h mirrors it to: share of what wo sees that the
// light reaches. Stays exact at the horizon.
inline double unshadowed(const ShadingDirection& wi, const ShadingDirection& wo, const Roughness& alpha) {
  if (!isAbove(wi)) return 0;
  const double seen = 1 + lambda(wo, alpha);
  return seen / (seen + lambda(wi, alpha));
}

} // namespace surflect::material::ggx
