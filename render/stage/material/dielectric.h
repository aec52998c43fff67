// Glass, water, ice: reflects and refracts, smooth or rough, seen from outside (wo above) or inside.
//
// [Walter 2007] Microfacet models for refraction through rough surfaces, EGSR.
// [Kulla 2017] for what single scattering loses, shared out between both sides.
// [Veach 1997] Robust Monte Carlo methods for light transport simulation, §5.2.
//
// Radiance grows by n^2 as it enters a medium of index n. Here it is L / n^2 that is scattered: it does not
// change, no sample weighs more than 1, and where camera and lights stand in air it is radiance. Reciprocity
// then reads f(wi, wo) / n_i^2 = f(wo, wi) / n_o^2, n_i and n_o the indices where wi and wo are.
#pragma once

#include "render/stage/material/bsdf.h"
#include "render/stage/material/energy_compensation.h"

namespace surflect::material {

// What a rough interface loses, seen from outside and from inside; for one index of refraction. To be shared.
struct DielectricLosses {
  explicit DielectricLosses(double eta);

  double eta;
  double passed; // 1 - meanDielectricFresnel(eta): share of even light outside that enters
  EnergyCompensation outside, inside;
};

struct Dielectric {
  using Bsdf = struct DielectricBsdf;

  double eta = 1.5;        // index of refraction inside over that outside; not 1
  double alpha = 0;        // 0..1; below kSmooth: smooth
  Rgb absorption{0, 0, 0}; // inside, 1/m; the tracer applies transmittance() along each path through it
  const DielectricLosses* losses = nullptr; // for this eta; not read where smooth
  Rgb absorptionOutside{0, 0, 0};           // where another medium than air lies there
};

// exp(-absorption distance), distance in metres.  Beer's law
Rgb transmittance(const Rgb& absorption, double distance);

bool isSpecular(const Dielectric& dielectric);

// As seen from the side of wo, which is made to be above.
struct DielectricBsdf {
  DielectricBsdf(const Dielectric& dielectric, const ShadingDirection& towards);

  bool isClear, isOutside;
  ShadingDirection wo;
  double eta; // index beyond over that here
  // Where it is rough and wo is not at the horizon:
  Roughness alpha;                // bounded
  LossesAtRoughness here, beyond; // of light that leaves on wo's side and on the other
  double lost = 0;                // of light that leaves towards wo
  double shareBeyond = 0;         // of it, what is given back on the other side
};

Rgb evaluate(const DielectricBsdf& bsdf, const ShadingDirection& wi);
double pdf(const DielectricBsdf& bsdf, const ShadingDirection& wi);
std::optional<ScatterSample> sample(const DielectricBsdf& bsdf, const Uniforms& u);

} // namespace surflect::material
