// Glass, water, ice: reflects and refracts, smooth or rough, seen from outside (wo above) or inside.
//
// [Walter 2007] Microfacet models for refraction through rough surfaces, EGSR. [Kulla 2017] energy lost by
// single scattering, distributed to both sides. [Veach 1997] Robust Monte Carlo methods for light transport
// simulation, §5.2.
//
// Radiance grows by n^2 when it enters a medium of index n. The quantity here is L / n^2, which is constant
// along a path: no sample weighs more than 1, and it is radiance if camera and lights are in air. Reciprocity
// then reads f(wi, wo) / n_i^2 = f(wo, wi) / n_o^2, with n_i and n_o the indices at wi and wo.
#pragma once

#include "render/stage/material/bsdf.h"
#include "render/stage/material/energy_compensation.h"

namespace surflect::material {

// Losses of a rough interface, seen from outside and from inside, for one index of refraction; shared by
// materials.
struct DielectricLosses {
  explicit DielectricLosses(double eta);

  double eta;
  double passed; // 1 - meanDielectricFresnel(eta): share of even outside light that enters
  EnergyCompensation outside, inside;
};

struct Dielectric {
  using Bsdf = struct DielectricBsdf;

  double eta = 1.5;        // index inside over index outside; not 1
  double alpha = 0;        // 0..1; below kSmooth: smooth
  Rgb absorption{0, 0, 0}; // inside, 1/m; the tracer applies transmittance() along each path through it
  const DielectricLosses* losses = nullptr; // for this eta; not read where smooth
  Rgb absorptionOutside{0, 0, 0};           // if another medium than air is outside
};

// Beer's law: exp(-absorption distance), distance in metres.
Rgb transmittance(const Rgb& absorption, double distance);

bool isSpecular(const Dielectric& dielectric);

// Interface seen from the side of wo, which is made to be above.
struct DielectricBsdf {
  DielectricBsdf(const Dielectric& dielectric, const ShadingDirection& towards);

  bool isClear, isOutside;
  ShadingDirection wo;
  double eta; // index on the far side over index on wo's side
  // Set if the surface is rough and wo is not at the horizon:
  Roughness alpha;                // bounded
  LossesAtRoughness here, beyond; // for light leaving on wo's side and on the other
  double lost = 0;                // share of light towards wo that single scattering loses
  double shareBeyond = 0;         // part of `lost` that is returned on the other side
};

Rgb evaluate(const DielectricBsdf& bsdf, const ShadingDirection& wi);
double pdf(const DielectricBsdf& bsdf, const ShadingDirection& wi);
std::optional<ScatterSample> sample(const DielectricBsdf& bsdf, const Uniforms& u);

} // namespace surflect::material
