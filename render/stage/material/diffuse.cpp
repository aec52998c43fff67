#include "render/stage/material/diffuse.h"

namespace surflect {

namespace {

// 1 - E(mu)
double loss(double r, double mu) { return std::max(0.0, 1 - eon::directionalAlbedo(r, mu)); }

// At the horizon, towards the light, f cos does not fall to 0: half of a rough surface's samples are even.
double evenShare(const RoughDiffuse& rough) { return rough.roughness / 2; }

} // namespace

Rgb evaluate(const LambertView& view, const ShadingDirection& wi) {
  return view.isSeen ? scaled(cosineDensity(wi), view.albedo) : Rgb{};
}

double pdf(const LambertView& view, const ShadingDirection& wi) {
  return view.isSeen ? cosineDensity(wi) : 0;
}

std::optional<ScatterSample> sample(const LambertView& view, const Uniforms& u) {
  if (!view.isSeen) return std::nullopt;
  const ShadingDirection wi = cosineDirection(u[1], u[2]);
  if (!isAbove(wi)) return std::nullopt;
  return ScatterSample{wi, view.albedo, cosineDensity(wi)};
}

RoughDiffuseView::RoughDiffuseView(const RoughDiffuse& material, const ShadingDirection& towards)
    : rough(material), wo(towards) {
  if (!isAbove(wo)) return;
  const double meanE = eon::meanAlbedo(rough.roughness);
  // Without roughness 0/0: nothing is lost.
  const double lost = loss(rough.roughness, wo.z()) / std::max(1e-9, 1 - meanE);
  multiple = byChannel(rough.albedo, [&](double rho) { return eon::multipleAlbedo(rho, meanE) * lost; });
}

Rgb evaluate(const RoughDiffuseView& view, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(view.wo)) return {};
  const double single = eon::single(view.rough.roughness, wi, view.wo);
  const Rgb f = scaled(single, view.rough.albedo) + scaled(loss(view.rough.roughness, wi.z()), view.multiple);
  return scaled(cosineDensity(wi), f);
}

double pdf(const RoughDiffuseView& view, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(view.wo)) return 0;
  const double even = evenShare(view.rough);
  return even * hemisphereDensity(wi) + (1 - even) * cosineDensity(wi);
}

std::optional<ScatterSample> sample(const RoughDiffuseView& view, const Uniforms& u) {
  if (!isAbove(view.wo)) return std::nullopt;
  const ShadingDirection wi =
      u[0] < evenShare(view.rough) ? hemisphereDirection(u[1], u[2]) : cosineDirection(u[1], u[2]);
  const double density = pdf(view, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(view, wi)), density};
}

} // namespace surflect
