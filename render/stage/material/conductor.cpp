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

// What does not depend on where light comes from. Rough, wo above.
struct View {
  View(const Conductor& seen, const ShadingDirection& towards)
      : conductor(seen), table(*seen.mirrorLoss), wo(towards), alpha(bounded(seen.alpha)),
        lost(table.loss(wo, alpha)) {}

  const Conductor& conductor;
  const LossTable& table;
  ShadingDirection wo;
  Roughness alpha;
  double lost;
};

bool scatters(const Conductor& conductor, const ShadingDirection& wi, const ShadingDirection& wo) {
  assert(isSpecular(conductor) || conductor.mirrorLoss);
  return !isSpecular(conductor) && isAbove(wi) && isAbove(wo);
}

Rgb evaluate(const View& view, const ShadingDirection& wi) {
  const double single = ggx::reflected(wi, view.wo, view.alpha);
  const Rgb fresnel = fresnelOf(view.conductor, halfCosine(wi, view.wo));
  const double meanLoss = view.table.meanLoss(view.alpha);
  const double multiple = view.table.loss(wi, view.alpha) * view.lost / meanLoss * cosineDensity(wi);
  const Rgb colors = byChannel(view.conductor.color, view.conductor.grazingTint, [&](double F0, double tint) {
    return multipleReflectance(meanConductorFresnel(F0, tint), meanLoss);
  });
  return scaled(single, fresnel) + scaled(multiple, colors);
}

double pdf(const View& view, const ShadingDirection& wi) {
  return (1 - view.lost) * ggx::reflectedDensity(wi, view.wo, view.alpha) +
         view.lost * grazingDensity(wi, view.alpha);
}

} // namespace

LossTable mirrorLossTable() {
  return LossTable([](const ShadingDirection& wo, const ShadingDirection& h,
                      const Roughness& alpha) { return ggx::unshadowed(mirrored(wo, h), wo, alpha); },
                   LossTable::Shape::anisotropic, LossTable::Coordinate::stretched);
}

bool isSpecular(const Conductor& conductor) { return isSmooth(conductor.alpha); }

Rgb evaluate(const Conductor& conductor, const ShadingDirection& wi, const ShadingDirection& wo) {
  return scatters(conductor, wi, wo) ? evaluate(View(conductor, wo), wi) : Rgb{};
}

double pdf(const Conductor& conductor, const ShadingDirection& wi, const ShadingDirection& wo) {
  return scatters(conductor, wi, wo) ? pdf(View(conductor, wo), wi) : 0;
}

std::optional<ScatterSample> sample(const Conductor& conductor, const ShadingDirection& wo,
                                    const Uniforms& u) {
  if (!isAbove(wo)) return std::nullopt;
  if (isSpecular(conductor))
    return ScatterSample{{-wo.x(), -wo.y(), wo.z()}, fresnelOf(conductor, wo.z()), 0, true};
  const View view(conductor, wo);
  const ShadingDirection wi = u[0] < view.lost ? grazingDirection(view.alpha, u[1], u[2])
                                               : mirrored(wo, ggx::visibleNormal(wo, view.alpha, u[1], u[2]));
  if (!isAbove(wi)) return std::nullopt; // hidden by the surface
  const double density = pdf(view, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(view, wi)), density};
}

} // namespace surflect
