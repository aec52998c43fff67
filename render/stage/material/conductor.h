// Metals, polished or rough, brushed or not; fibres too, with a tangent along them and little roughness along
// it: a tight arc of highlights across, as hair has.
//
// Single scattering as [Walter 2007, Eq. 20] with masking correlated by height [Heitz 2014], and the rest as
// [Kulla 2017]. The colour is that at normal incidence and a tint at 82 degrees [Kutz 2021] rather than a
// complex index of refraction: textures can hold it, and it fits measured metals closely.
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

// Of facets that reflect everything; what every Conductor refers to.
EnergyCompensation mirrorEnergyCompensation();

bool isSpecular(const Conductor& conductor);

struct ConductorBsdf {
  ConductorBsdf(const Conductor& seen, const ShadingDirection& towards);

  Conductor conductor;
  ShadingDirection wo;
  bool isMirror;
  // Where it is rough and seen from above:
  Roughness alpha; // bounded
  LossesAtRoughness losses;
  double lost = 0; // of light that leaves towards wo
  Rgb multiple;    // of light reflected more than once, for what is lost along wi
};

Rgb evaluate(const ConductorBsdf& bsdf, const ShadingDirection& wi);
double pdf(const ConductorBsdf& bsdf, const ShadingDirection& wi);
std::optional<ScatterSample> sample(const ConductorBsdf& bsdf, const Uniforms& u);

} // namespace surflect::material
