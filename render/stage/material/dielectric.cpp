#include "render/stage/material/dielectric.h"

#include "render/stage/material/fresnel.h"
#include "render/stage/material/ggx.h"

#include <cassert>

namespace surflect::material {

namespace {

// Symbols, seen from the side of wo, which is made to be above: eta index on the far side over index on this
// side, F Fresnel reflectance of a facet, x share of the lost light that is returned on the far side.

ShadingDirection flipped(const ShadingDirection& w) { return {w.x(), w.y(), -w.z()}; }

// Facet normal that refracts wi into wo, on wo's side; none if the indices are equal.  [Walter 2007, Eq. 16]
std::optional<ShadingDirection> refractingFacet(const ShadingDirection& wi, const ShadingDirection& wo,
                                                double eta) {
  const ShadingDirection sum = wo + eta * wi;
  if (!(std::abs(sum.z()) > 0)) return std::nullopt;
  const ShadingDirection h = normalized(sum.z() < 0 ? -sum : sum);
  if (dot(wo, h) <= 0 || dot(wi, h) >= 0) return std::nullopt;
  return h;
}

// Direction of light that a facet h refracts into wo; mu = wo . h, muT cosine on the far side.  [Walter 2007,
// Eq. 40]
ShadingDirection refracted(const ShadingDirection& wo, const ShadingDirection& h, double mu, double muT,
                           double eta) {
  return normalized((mu / eta - muT) * h + (-1 / eta) * wo);
}

// Jacobian d omega_h / d omega_i.  [Walter 2007, Eq. 17]
double facetsPerRefracted(const ShadingDirection& wi, const ShadingDirection& wo, const ShadingDirection& h,
                          double eta) {
  return eta * eta * std::abs(dot(wi, h)) / squared(dot(wo, h) + eta * dot(wi, h));
}

// f cos for L / n^2, with uncorrelated masking on both sides.  [Walter 2007, Eq. 21]
double transmitted(const ShadingDirection& wi, const ShadingDirection& wo, const ShadingDirection& h,
                   double eta, const Roughness& alpha) {
  return ggx::visibleDensity(h, wo, alpha) * ggx::G1(flipped(wi), alpha) * facetsPerRefracted(wi, wo, h, eta);
}

// Share x. Reciprocity requires x_here loss_here = eta^2 x_beyond loss_beyond. With equal losses on both
// sides, 1 - meanF satisfies it; otherwise the geometric mean is used, clamped so that no energy is gained.
double shareBeyond(double passHere, double passBeyond, double meanLossHere, double meanLossBeyond) {
  const double ratio = meanLossBeyond / meanLossHere;
  return passHere * std::min({std::sqrt(ratio), 1 / passHere, ratio / passBeyond});
}

bool isOff(const ShadingDirection& w) { return isAbove(w) || isBelow(w); } // the horizon

bool scatters(const DielectricBsdf& bsdf, const ShadingDirection& wi) {
  return !bsdf.isClear && isOff(wi) && isAbove(bsdf.wo);
}

// Transform to wo's side and back.
ShadingDirection turned(const DielectricBsdf& bsdf, const ShadingDirection& wi) {
  return bsdf.isOutside ? wi : flipped(wi);
}

// wi is transformed by turned(), here and below.
double evaluateTurned(const DielectricBsdf& bsdf, const ShadingDirection& wi) {
  const auto& [isClear, isOutside, wo, eta, alpha, here, beyond, lost, x] = bsdf;
  if (isAbove(wi)) {
    const double F = dielectricFresnel(halfCosine(wi, wo), eta);
    const double multiple = (1 - x) * lost * here.loss(wi) / here.meanLoss;
    return F * ggx::reflected(wi, wo, alpha) + multiple * cosineDensity(wi);
  }
  const double multiple = x * lost * beyond.loss(wi) / beyond.meanLoss * cosineDensity(flipped(wi));
  const auto h = refractingFacet(wi, wo, eta);
  if (!h) return multiple;
  return (1 - dielectricFresnel(dot(wo, *h), eta)) * transmitted(wi, wo, *h, eta, alpha) + multiple;
}

double pdfTurned(const DielectricBsdf& bsdf, const ShadingDirection& wi) {
  const auto& [isClear, isOutside, wo, eta, alpha, here, beyond, lost, x] = bsdf;
  const double grazing = grazingDensity(wi, alpha);
  if (isAbove(wi)) {
    const double F = dielectricFresnel(halfCosine(wi, wo), eta);
    return (1 - lost) * F * ggx::reflectedDensity(wi, wo, alpha) + lost * (1 - x) * grazing;
  }
  const auto h = refractingFacet(wi, wo, eta);
  if (!h) return lost * x * grazing;
  return (1 - lost) * (1 - dielectricFresnel(dot(wo, *h), eta)) * ggx::visibleDensity(*h, wo, alpha) *
             facetsPerRefracted(wi, wo, *h, eta) +
         lost * x * grazing;
}

// Albedo of a facet for light from wo: the reflected and refracted parts, each times the fraction that other
// facets do not block.
double facetAlbedo(const ShadingDirection& wo, const ShadingDirection& h, const Roughness& alpha,
                   double eta) {
  const double mu = dot(wo, h);
  if (mu <= 0) return 0;
  const double F = dielectricFresnel(mu, eta);
  double albedo = F * ggx::unshadowed(mirrored(wo, h), wo, alpha);
  if (F < 1) {
    const ShadingDirection wi = refracted(wo, h, mu, refractedCosine(mu, eta), eta);
    if (wi.z() < 0) albedo += (1 - F) * ggx::G1(wi, alpha);
  }
  return albedo;
}

EnergyCompensation lossesFrom(double eta) {
  return EnergyCompensation([eta](const ShadingDirection& wo, const ShadingDirection& h,
                                  const Roughness& alpha) { return facetAlbedo(wo, h, alpha, eta); },
                            EnergyCompensation::Shape::isotropic, EnergyCompensation::Coordinate::stretched);
}

ScatterSample sampleClear(const DielectricBsdf& bsdf, double u) {
  const ShadingDirection& wo = bsdf.wo;
  if (u < dielectricFresnel(wo.z(), bsdf.eta))
    return {turned(bsdf, {-wo.x(), -wo.y(), wo.z()}), {1, 1, 1}, 0, true};
  const ShadingDirection wi = refracted(wo, {0, 0, 1}, wo.z(), refractedCosine(wo.z(), bsdf.eta), bsdf.eta);
  return {turned(bsdf, wi), {1, 1, 1}, 0, true};
}

} // namespace

DielectricLosses::DielectricLosses(double etaInside)
    : eta(etaInside), passed(1 - meanDielectricFresnel(eta)), outside(lossesFrom(eta)),
      inside(lossesFrom(1 / eta)) {}

Rgb transmittance(const Rgb& absorption, double distance) {
  return byChannel(absorption, [&](double sigma) { return std::exp(-sigma * distance); });
}

bool isSpecular(const Dielectric& dielectric) { return dielectric.alpha < kSmooth; }

DielectricBsdf::DielectricBsdf(const Dielectric& dielectric, const ShadingDirection& towards)
    : isClear(isSpecular(dielectric)), isOutside(isAbove(towards)),
      wo(isOutside ? towards : flipped(towards)), eta(isOutside ? dielectric.eta : 1 / dielectric.eta),
      alpha(bounded({dielectric.alpha, dielectric.alpha})) {
  if (isClear || !isAbove(wo)) return;
  const DielectricLosses* losses = dielectric.losses;
  assert(losses && losses->eta == dielectric.eta);
  here = (isOutside ? losses->outside : losses->inside).at(alpha);
  beyond = (isOutside ? losses->inside : losses->outside).at(alpha);
  lost = here.loss(wo);
  const double entering = losses->passed, leaving = entering / squared(dielectric.eta);
  shareBeyond = surflect::material::shareBeyond(
      isOutside ? entering : leaving, isOutside ? leaving : entering, here.meanLoss, beyond.meanLoss);
}

Rgb evaluate(const DielectricBsdf& bsdf, const ShadingDirection& wi) {
  return scatters(bsdf, wi) ? gray(evaluateTurned(bsdf, turned(bsdf, wi))) : Rgb{};
}

double pdf(const DielectricBsdf& bsdf, const ShadingDirection& wi) {
  return scatters(bsdf, wi) ? pdfTurned(bsdf, turned(bsdf, wi)) : 0;
}

std::optional<ScatterSample> sample(const DielectricBsdf& bsdf, const Uniforms& u) {
  if (!isAbove(bsdf.wo)) return std::nullopt;
  if (bsdf.isClear) return sampleClear(bsdf, u[0]);
  ShadingDirection wi;
  bool reflects;
  if (u[0] < bsdf.lost) {
    reflects = u[0] >= bsdf.lost * bsdf.shareBeyond;
    wi = grazingDirection(bsdf.alpha, u[1], u[2]);
    if (!reflects) wi = flipped(wi);
  } else {
    const ShadingDirection h = ggx::visibleNormal(bsdf.wo, bsdf.alpha, u[1], u[2]);
    const double mu = dot(bsdf.wo, h), F = dielectricFresnel(mu, bsdf.eta);
    reflects = u[0] < bsdf.lost + (1 - bsdf.lost) * F;
    wi = reflects ? mirrored(bsdf.wo, h) : refracted(bsdf.wo, h, mu, refractedCosine(mu, bsdf.eta), bsdf.eta);
  }
  if (reflects ? !isAbove(wi) : !isBelow(wi)) return std::nullopt; // below the surface
  const double density = pdfTurned(bsdf, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{turned(bsdf, wi), gray(evaluateTurned(bsdf, wi) / density), density};
}

} // namespace surflect::material
