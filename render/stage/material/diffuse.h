// Diffuse surfaces, Lambertian and rough.
//
// [Fujii 2012] A tiny improvement of Oren-Nayar reflectance model. [Portsmouth 2025] Portsmouth, Kutz, Hill:
// EON: a practical energy-preserving rough diffuse BRDF, JCGT 14 (1). Symbols: r roughness, rho albedo, mu
// cosine to the normal, E directional albedo of a white surface scattering once.
#pragma once

#include "render/stage/material/bsdf.h"

namespace surflect::material {

struct Lambert {
  using Bsdf = struct LambertBsdf;

  Rgb albedo{0.5f, 0.5f, 0.5f}; // 0..1
};

struct LambertBsdf {
  LambertBsdf(const Lambert& lambert, const ShadingDirection& wo)
      : albedo(lambert.albedo), isSeen(isAbove(wo)) {}

  Rgb albedo;
  bool isSeen;
};

Rgb evaluate(const LambertBsdf& bsdf, const ShadingDirection& wi);
double pdf(const LambertBsdf& bsdf, const ShadingDirection& wi);
std::optional<ScatterSample> sample(const LambertBsdf& bsdf, const Uniforms& u);

// Cloth, plaster, clay: flatter than Lambert and brighter towards the light. Oren and Nayar's model in
// Fujii's form, with energy compensation for light lost between facets: white is white.
struct RoughDiffuse {
  using Bsdf = struct RoughDiffuseBsdf;

  Rgb albedo{0.5f, 0.5f, 0.5f}; // 0..1, for single scattering: rough surfaces are more saturated
  double roughness = 0;         // 0..1
};

struct RoughDiffuseBsdf {
  RoughDiffuseBsdf(const RoughDiffuse& rough, const ShadingDirection& towards);

  RoughDiffuse rough;
  ShadingDirection wo;
  Rgb multiple; // colour factor of multiply scattered light, for the loss along wi
};

Rgb evaluate(const RoughDiffuseBsdf& bsdf, const ShadingDirection& wi);
double pdf(const RoughDiffuseBsdf& bsdf, const ShadingDirection& wi);
std::optional<ScatterSample> sample(const RoughDiffuseBsdf& bsdf, const Uniforms& u);

namespace eon {

// Scale A, by which E reaches 1 at grazing angles and nowhere more.  [Fujii 2012; Portsmouth 2025]
inline double scale(double r) { return 1 / (1 + (0.5 - 2 / (3 * kPi)) * r); }

// Single scattering of a white surface, pi f.  [Fujii 2012; Portsmouth 2025]
inline double single(double r, const ShadingDirection& wi, const ShadingDirection& wo) {
  const double s = dot(wi, wo) - wi.z() * wo.z();
  return scale(r) * std::max(0.0, 1 + r * (s > 0 ? s / std::max(wi.z(), wo.z()) : s));
}

// E(mu)  [Portsmouth 2025], with tan (1 - sin^3) written so that it is exact at the horizon.
inline double directionalAlbedo(double r, double mu) {
  const double sine = std::sqrt(std::max(0.0, 1 - mu * mu)), theta = std::acos(std::min(mu, 1.0));
  const double tanPart = sine * mu * (1 + sine + sine * sine) / (1 + sine);
  const double G = sine * (theta - sine * mu) + 2.0 / 3 * (tanPart - sine);
  return scale(r) * (1 + r * G / kPi);
}

// Mean of E over the hemisphere, 2 int E mu dmu.  [Portsmouth 2025]
inline double meanAlbedo(double r) { return scale(r) * (1 + (2.0 / 3 - 28 / (15 * kPi)) * r); }

// Colour of multiply scattered light.  [Portsmouth 2025]
inline double multipleAlbedo(double rho, double meanE) { return rho * rho * meanE / (1 - rho * (1 - meanE)); }

} // namespace eon

} // namespace surflect::material
