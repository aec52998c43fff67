#include "render/stage/material/conductor.h"

#include "render/stage/material/fresnel.h"
#include "render/stage/material/reflection.h"

#include <cassert>

namespace surflect {

namespace {

Rgb fresnelOf(const Conductor& conductor, double mu) {
  return byChannel(conductor.color, conductor.grazingTint,
                   [&](double F0, double tint) { return conductorFresnel(mu, F0, tint); });
}

// What remains of light that is reflected between facets at least twice; meanF is a facet's mean
// reflectance.  [Kulla 2017]
double multipleReflectance(double meanF, double meanLoss) {
  const double meanE = 1 - meanLoss;
  return meanF * meanF * meanE / (1 - meanF * meanLoss);
}

bool scatters(const ConductorView& view, const ShadingDirection& wi) {
  return !view.isMirror && isAbove(wi) && isAbove(view.wo);
}

} // namespace

LossTable mirrorLossTable() {
  return LossTable([](const ShadingDirection& wo, const ShadingDirection& h,
                      const Roughness& alpha) { return ggx::unshadowed(mirrored(wo, h), wo, alpha); },
                   LossTable::Shape::anisotropic, LossTable::Coordinate::stretched);
}

bool isSpecular(const Conductor& conductor) { return isSmooth(conductor.alpha); }

ConductorView::ConductorView(const Conductor& seen, const ShadingDirection& towards)
    : conductor(seen), wo(towards), isMirror(isSpecular(seen)), alpha(bounded(seen.alpha)) {
  if (isMirror || !isAbove(wo)) return;
  assert(conductor.mirrorLoss);
  losses = conductor.mirrorLoss->at(alpha);
  lost = losses.loss(wo);
  multiple = byChannel(conductor.color, conductor.grazingTint, [&](double F0, double tint) {
    return multipleReflectance(meanConductorFresnel(F0, tint), losses.meanLoss) * lost / losses.meanLoss;
  });
}

Rgb evaluate(const ConductorView& view, const ShadingDirection& wi) {
  if (!scatters(view, wi)) return {};
  const double single = ggx::reflected(wi, view.wo, view.alpha);
  const Rgb fresnel = fresnelOf(view.conductor, halfCosine(wi, view.wo));
  return scaled(single, fresnel) + scaled(view.losses.loss(wi) * cosineDensity(wi), view.multiple);
}

double pdf(const ConductorView& view, const ShadingDirection& wi) {
  if (!scatters(view, wi)) return 0;
  return (1 - view.lost) * ggx::reflectedDensity(wi, view.wo, view.alpha) +
         view.lost * grazingDensity(wi, view.alpha);
}

std::optional<ScatterSample> sample(const ConductorView& view, const Uniforms& u) {
  const ShadingDirection& wo = view.wo;
  if (!isAbove(wo)) return std::nullopt;
  if (view.isMirror)
    return ScatterSample{{-wo.x(), -wo.y(), wo.z()}, fresnelOf(view.conductor, wo.z()), 0, true};
  const ShadingDirection wi = u[0] < view.lost ? grazingDirection(view.alpha, u[1], u[2])
                                               : mirrored(wo, ggx::visibleNormal(wo, view.alpha, u[1], u[2]));
  if (!isAbove(wi)) return std::nullopt; // hidden by the surface
  const double density = pdf(view, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(view, wi)), density};
}

} // namespace surflect
