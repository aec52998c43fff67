// Reflection by GGX facets without the Fresnel factor.
#pragma once

#include "render/stage/material/ggx.h"

#include <optional>

namespace surflect::material::ggx {

// f cos of fully reflecting facets; wi and wo above.  [Walter 2007, Eq. 20]
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

// reflected / reflectedDensity for wo above and wi mirrored at h: share of the facets visible from wo that
// light from wi reaches. Exact at the horizon.
inline double unshadowed(const ShadingDirection& wi, const ShadingDirection& wo, const Roughness& alpha) {
  if (!isAbove(wi)) return 0;
  const double seen = 1 + lambda(wo, alpha);
  return seen / (seen + lambda(wi, alpha));
}

} // namespace surflect::material::ggx
