// Clear dielectric layer over another material: plastic, varnish, glaze.
//
// [Kelemen 2001] Kelemen, Szirmay-Kalos: A microfacet based coupled specular-matte BRDF model with importance
// sampling, Eurographics. Symbols: R(w) reflectance of the coat along w, T = 1 - R, meanT its mean over the
// hemisphere, rho albedo of the base, eta index of refraction of the coat.
//
// The coat reflects R and transmits the rest. Over a Lambert base it transmits
//   T(wi) T(wo) / (eta^2 (1 - rho (1 - meanT / eta^2))) :
// light that the coat reflects back to the base is scattered again, which saturates colours; a white base
// stays white. Other bases get min(T(wi), T(wo)): reciprocal, never a gain of energy, exact for a mirror.
#pragma once

#include "render/stage/material/conductor.h"
#include "render/stage/material/diffuse.h"
#include "render/stage/material/merl.h"
#include "render/stage/material/ward.h"

#include <variant>

namespace surflect::material {

// T of rough coats of one index of refraction, over direction and roughness; shared by materials.
struct CoatTransmission {
  explicit CoatTransmission(double eta);

  double eta;
  EnergyCompensation table; // of the reflection
};

using CoatBase = std::variant<Lambert, RoughDiffuse, Conductor, Ward, Measured>;

struct ClearCoat {
  using Bsdf = struct ClearCoatBsdf;

  double eta = 1.5; // above 1
  double alpha = 0; // 0..1; below kSmooth: smooth
  CoatBase base;
  const CoatTransmission* transmission = nullptr; // for this eta; not read where smooth
};

struct ClearCoatBsdf {
  ClearCoatBsdf(const ClearCoat& coat, const ShadingDirection& towards);

  double eta;
  bool isSmooth;
  ShadingDirection wo;
  Roughness alpha;         // bounded
  LossesAtRoughness coatT; // if the coat is rough and seen from above
  double To = 0;           // T(wo)
  Rgb throughCoat;         // factor of a Lambert base's reflection beside T(wi) T(wo)
  std::variant<LambertBsdf, RoughDiffuseBsdf, ConductorBsdf, WardBsdf, MeasuredBsdf> base;
};

Rgb evaluate(const ClearCoatBsdf& bsdf, const ShadingDirection& wi);
double pdf(const ClearCoatBsdf& bsdf, const ShadingDirection& wi);
std::optional<ScatterSample> sample(const ClearCoatBsdf& bsdf, const Uniforms& u);

} // namespace surflect::material
