#include "render/stage/material/conductor.h"

#include "render/stage/material/fresnel.h"
#include "render/stage/material/ggx.h"

#include <cassert>

namespace surflect::material {

namespace {

Rgb fresnelOf(const Conductor& conductor, double mu) {
  return byChannel(conductor.color, conductor.grazingTint,
                   [&](double F0, double tint) { return conductorFresnel(mu, F0, tint); });
}

// Reflectance of light reflected between facets at least twice; meanF is a facet's mean reflectance.  [Kulla
// 2017]
double multipleReflectance(double meanF, double meanLoss) {
  const double meanE = 1 - meanLoss;
  return meanF * meanF * meanE / (1 - meanF * meanLoss);
}

bool scatters(const ConductorBsdf& bsdf, const ShadingDirection& wi) {
  return !bsdf.isMirror && isAbove(wi) && isAbove(bsdf.wo);
}

} // namespace

EnergyCompensation mirrorEnergyCompensation() {
  return EnergyCompensation(
      [](const ShadingDirection& wo, const ShadingDirection& h, const Roughness& alpha) {
        return ggx::unshadowed(mirrored(wo, h), wo, alpha);
      },
      EnergyCompensation::Shape::anisotropic, EnergyCompensation::Coordinate::stretched);
}

bool isSpecular(const Conductor& conductor) { return isSmooth(conductor.alpha); }

ConductorBsdf::ConductorBsdf(const Conductor& seen, const ShadingDirection& towards)
    : conductor(seen), wo(towards), isMirror(isSpecular(seen)), alpha(bounded(seen.alpha)) {
  if (isMirror || !isAbove(wo)) return;
  assert(conductor.mirrorLoss);
  losses = conductor.mirrorLoss->at(alpha);
  lost = losses.loss(wo);
  multiple = byChannel(conductor.color, conductor.grazingTint, [&](double F0, double tint) {
    return multipleReflectance(meanConductorFresnel(F0, tint), losses.meanLoss) * lost / losses.meanLoss;
  });
}

Rgb evaluate(const ConductorBsdf& bsdf, const ShadingDirection& wi) {
  if (!scatters(bsdf, wi)) return {};
  const double single = ggx::reflected(wi, bsdf.wo, bsdf.alpha);
  const Rgb fresnel = fresnelOf(bsdf.conductor, halfCosine(wi, bsdf.wo));
  return scaled(single, fresnel) + scaled(bsdf.losses.loss(wi) * cosineDensity(wi), bsdf.multiple);
}

double pdf(const ConductorBsdf& bsdf, const ShadingDirection& wi) {
  if (!scatters(bsdf, wi)) return 0;
  return (1 - bsdf.lost) * ggx::reflectedDensity(wi, bsdf.wo, bsdf.alpha) +
         bsdf.lost * grazingDensity(wi, bsdf.alpha);
}

std::optional<ScatterSample> sample(const ConductorBsdf& bsdf, const Uniforms& u) {
  const ShadingDirection& wo = bsdf.wo;
  if (!isAbove(wo)) return std::nullopt;
  if (bsdf.isMirror)
    return ScatterSample{{-wo.x(), -wo.y(), wo.z()}, fresnelOf(bsdf.conductor, wo.z()), 0, true};
  const ShadingDirection wi = u[0] < bsdf.lost ? grazingDirection(bsdf.alpha, u[1], u[2])
                                               : mirrored(wo, ggx::visibleNormal(wo, bsdf.alpha, u[1], u[2]));
  if (!isAbove(wi)) return std::nullopt; // below the surface
  const double density = pdf(bsdf, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(bsdf, wi)), density};
}

} // namespace surflect::material
