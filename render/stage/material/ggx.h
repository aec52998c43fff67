// The GGX distribution of microfacets, with Smith's masking and sampling of visible normals.
//
// [Walter 2007] Microfacet models for refraction through rough surfaces, EGSR.
// [Heitz 2014] Understanding the masking-shadowing function in microfacet-based BRDFs, JCGT 3 (2).
// [Heitz 2018] Sampling the GGX distribution of visible normals, JCGT 7 (4).
// [Dupuy 2023] Dupuy, Benyoub: Sampling visible GGX normals with spherical caps, Computer Graphics Forum 42.
// Symbols: w a direction, h a microfacet's normal, D density of normals, Lambda auxiliary function of
// masking.
#pragma once

#include "render/stage/material/shading.h"

#include <optional>

namespace surflect::material {

// Standard deviations, up to a factor, of the microfacets' slopes along x and y.
struct Roughness {
  double x = 1, y = 1; // alpha
};

// Smaller roughness counts as a mirror. The largest roughness is 1.
inline constexpr double kSmooth = 1e-3;

inline bool isSmooth(const Roughness& alpha) { return alpha.x < kSmooth && alpha.y < kSmooth; }

// Roughness for the formulas: clamped, so that a surface that is a mirror along one axis only stays finite.
inline Roughness bounded(const Roughness& alpha) {
  return {std::clamp(alpha.x, kSmooth, 1.0), std::clamp(alpha.y, kSmooth, 1.0)};
}

namespace ggx {

// Density D of normals per steradian; projected onto the surface it integrates to 1.  [Heitz 2014, Eq. 85]
inline double density(const ShadingDirection& h, const Roughness& alpha) {
  const double stretched = squared(h.x() / alpha.x) + squared(h.y() / alpha.y) + squared(h.z());
  return 1 / (kPi * alpha.x * alpha.y * squared(stretched));
}

// Direction in the space in which the facets form a hemisphere.  [Heitz 2018, §3.1]
inline ShadingDirection stretched(const ShadingDirection& w, const Roughness& alpha) {
  return normalized(ShadingDirection(alpha.x * w.x(), alpha.y * w.y(), w.z()));
}

// Auxiliary function Lambda.  [Heitz 2014, Eqs. 72 and 86]
inline double lambda(const ShadingDirection& w, const Roughness& alpha) {
  const double slope = squared(alpha.x * w.x()) + squared(alpha.y * w.y());
  return (std::sqrt(1 + slope / squared(w.z())) - 1) / 2;
}

// G1: visible share of the facets facing w.  [Heitz 2014, Eq. 43]
inline double G1(const ShadingDirection& w, const Roughness& alpha) { return 1 / (1 + lambda(w, alpha)); }

// G2: share visible from both directions, on one side, with height correlation.  [Heitz 2014, Eq. 99]
inline double G2(const ShadingDirection& wi, const ShadingDirection& wo, const Roughness& alpha) {
  return 1 / (1 + lambda(wi, alpha) + lambda(wo, alpha));
}

// Density of the normals visible from w; integrates to 1.  [Heitz 2014, Eq. 16]
inline double visibleDensity(const ShadingDirection& h, const ShadingDirection& w, const Roughness& alpha) {
  return G1(w, alpha) * std::max(0.0, dot(w, h)) * density(h, alpha) / w.z();
}

// Samples a visible normal. Seen from w, a hemisphere's visible normals are half vectors of an even cap of
// directions. [Dupuy 2023, §3]
inline ShadingDirection visibleNormal(const ShadingDirection& w, const Roughness& alpha, double u, double v) {
  const ShadingDirection seen = stretched(w, alpha);
  const double phi = 2 * kPi * u;
  const double z = (1 - v) * (1 + seen.z()) - seen.z();
  const double r = std::sqrt(std::clamp(1 - z * z, 0.0, 1.0));
  const ShadingDirection h = ShadingDirection(r * std::cos(phi), r * std::sin(phi), z) + seen;
  return normalized(ShadingDirection(alpha.x * h.x(), alpha.y * h.y(), std::max(0.0, h.z())));
}

} // namespace ggx

} // namespace surflect::material

namespace surflect::material::ggx {

// Reflection by GGX facets without the Fresnel factor.

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
