#include "render/stage/material/diffuse.h"

namespace surflect::material {

namespace {

// 1 - E(mu)
double loss(double r, double mu) { return std::max(0.0, 1 - eon::directionalAlbedo(r, mu)); }

// Share of uniform samples: at the horizon, towards the light, f cos does not vanish, so rough surfaces use
// half.
double evenShare(const RoughDiffuse& rough) { return rough.roughness / 2; }

} // namespace

Rgb evaluate(const LambertBsdf& bsdf, const ShadingDirection& wi) {
  return bsdf.isSeen ? scaled(cosineDensity(wi), bsdf.albedo) : Rgb{};
}

double pdf(const LambertBsdf& bsdf, const ShadingDirection& wi) {
  return bsdf.isSeen ? cosineDensity(wi) : 0;
}

std::optional<ScatterSample> sample(const LambertBsdf& bsdf, const Uniforms& u) {
  if (!bsdf.isSeen) return std::nullopt;
  const ShadingDirection wi = cosineDirection(u[1], u[2]);
  if (!isAbove(wi)) return std::nullopt;
  return ScatterSample{wi, bsdf.albedo, cosineDensity(wi)};
}

RoughDiffuseBsdf::RoughDiffuseBsdf(const RoughDiffuse& material, const ShadingDirection& towards)
    : rough(material), wo(towards) {
  if (!isAbove(wo)) return;
  const double meanE = eon::meanAlbedo(rough.roughness);
  // Without roughness 0/0: there is no loss.
  const double lost = loss(rough.roughness, wo.z()) / std::max(1e-9, 1 - meanE);
  multiple = byChannel(rough.albedo, [&](double rho) { return eon::multipleAlbedo(rho, meanE) * lost; });
}

Rgb evaluate(const RoughDiffuseBsdf& bsdf, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(bsdf.wo)) return {};
  const double single = eon::single(bsdf.rough.roughness, wi, bsdf.wo);
  const Rgb f = scaled(single, bsdf.rough.albedo) + scaled(loss(bsdf.rough.roughness, wi.z()), bsdf.multiple);
  return scaled(cosineDensity(wi), f);
}

double pdf(const RoughDiffuseBsdf& bsdf, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(bsdf.wo)) return 0;
  const double even = evenShare(bsdf.rough);
  return even * hemisphereDensity(wi) + (1 - even) * cosineDensity(wi);
}

std::optional<ScatterSample> sample(const RoughDiffuseBsdf& bsdf, const Uniforms& u) {
  if (!isAbove(bsdf.wo)) return std::nullopt;
  const ShadingDirection wi =
      u[0] < evenShare(bsdf.rough) ? hemisphereDirection(u[1], u[2]) : cosineDirection(u[1], u[2]);
  const double density = pdf(bsdf, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(bsdf, wi)), density};
}

} // namespace surflect::material
