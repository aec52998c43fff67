// Metals, polished or rough, brushed or not. Also fibres: with little roughness along the tangent, a tight
// arc of highlights across it, as on hair.
//
// Single scattering follows [Walter 2007, Eq. 20] with height-correlated masking [Heitz 2014], multiple
// scattering [Kulla 2017]. Colour is given at normal incidence, with a tint at 82 degrees [Kutz 2021],
// instead of a complex index of refraction: textures can hold it, and it fits measured metals closely.
#pragma once

#include "render/stage/material/bsdf.h"
#include "render/stage/material/energy_compensation.h"

namespace surflect::material {

struct Conductor {
  using Bsdf = struct ConductorBsdf;

  Rgb color{1, 1, 1};                             // reflectance at normal incidence, 0..1
  Rgb grazingTint{1, 1, 1};                       // 0..1, factor on Schlick's curve at 82 degrees
  Roughness alpha{0.1, 0.1};                      // 0..1; both below kSmooth: a mirror
  const EnergyCompensation* mirrorLoss = nullptr; // mirrorEnergyCompensation(), shared; not read where smooth
};

// Losses of facets that reflect everything, to which every Conductor refers.
EnergyCompensation mirrorEnergyCompensation();

bool isSpecular(const Conductor& conductor);

struct ConductorBsdf {
  ConductorBsdf(const Conductor& seen, const ShadingDirection& towards);

  Conductor conductor;
  ShadingDirection wo;
  bool isMirror;
  // Set if the surface is rough and seen from above:
  Roughness alpha; // bounded
  LossesAtRoughness losses;
  double lost = 0; // share of light towards wo that single scattering loses
  Rgb multiple;    // colour factor of multiply reflected light, for the loss along wi
};

Rgb evaluate(const ConductorBsdf& bsdf, const ShadingDirection& wi);
double pdf(const ConductorBsdf& bsdf, const ShadingDirection& wi);
std::optional<ScatterSample> sample(const ConductorBsdf& bsdf, const Uniforms& u);

} // namespace surflect::material
