#include "render/stage/material/diffuse.h"

namespace surflect {

Rgb evaluate(const Lambert& lambert, const ShadingDirection& wi, const ShadingDirection& wo) {
  return isAbove(wo) ? scaled(cosineDensity(wi), lambert.albedo) : Rgb{};
}

double pdf(const Lambert&, const ShadingDirection& wi, const ShadingDirection& wo) {
  return isAbove(wo) ? cosineDensity(wi) : 0;
}

std::optional<ScatterSample> sample(const Lambert& lambert, const ShadingDirection& wo, const Uniforms& u) {
  if (!isAbove(wo)) return std::nullopt;
  const ShadingDirection wi = cosineDirection(u[1], u[2]);
  if (!isAbove(wi)) return std::nullopt;
  return ScatterSample{wi, lambert.albedo, cosineDensity(wi)};
}

Rgb evaluate(const RoughDiffuse& rough, const ShadingDirection& wi, const ShadingDirection& wo) {
  if (!isAbove(wi) || !isAbove(wo)) return {};
  const double r = rough.roughness, meanE = eon::meanAlbedo(r);
  const double single = eon::single(r, wi, wo);
  const double lossI = std::max(0.0, 1 - eon::directionalAlbedo(r, wi.z()));
  const double lossO = std::max(0.0, 1 - eon::directionalAlbedo(r, wo.z()));
  const double multiple = lossI * lossO / std::max(1e-9, 1 - meanE); // without roughness 0/0: nothing is lost
  const Rgb f = byChannel(
      rough.albedo, [&](double rho) { return rho * single + eon::multipleAlbedo(rho, meanE) * multiple; });
  return scaled(cosineDensity(wi), f);
}

// At the horizon, towards the light, f cos does not fall to 0: half of a rough surface's samples are even.
static double evenShare(const RoughDiffuse& rough) { return rough.roughness / 2; }

double pdf(const RoughDiffuse& rough, const ShadingDirection& wi, const ShadingDirection& wo) {
  if (!isAbove(wi) || !isAbove(wo)) return 0;
  const double even = evenShare(rough);
  return even * hemisphereDensity(wi) + (1 - even) * cosineDensity(wi);
}

std::optional<ScatterSample> sample(const RoughDiffuse& rough, const ShadingDirection& wo,
                                    const Uniforms& u) {
  if (!isAbove(wo)) return std::nullopt;
  const ShadingDirection wi =
      u[0] < evenShare(rough) ? hemisphereDirection(u[1], u[2]) : cosineDirection(u[1], u[2]);
  const double density = pdf(rough, wi, wo);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(rough, wi, wo)), density};
}

} // namespace surflect
