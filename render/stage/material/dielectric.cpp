#include "render/stage/material/dielectric.h"

#include "render/stage/material/fresnel.h"
#include "render/stage/material/reflection.h"

#include <cassert>

namespace surflect {

namespace {

// Symbols, all seen from the side of wo, which is made to be above: eta index beyond over index here, F
// Fresnel's reflectance at a facet, x share of the lost light that is given back beyond.

ShadingDirection flipped(const ShadingDirection& w) { return {w.x(), w.y(), -w.z()}; }

// The facet that refracts wi into wo, facing wo's side; none where the indices are matched.  [Walter 2007,
// Eq. 16]
std::optional<ShadingDirection> refractingFacet(const ShadingDirection& wi, const ShadingDirection& wo,
                                                double eta) {
  const ShadingDirection sum = wo + eta * wi;
  if (!(std::abs(sum.z()) > 0)) return std::nullopt;
  const ShadingDirection h = normalized(sum.z() < 0 ? -sum : sum);
  if (dot(wo, h) <= 0 || dot(wi, h) >= 0) return std::nullopt;
  return h;
}

// Where wo seen through a facet comes from; mu = wo . h, muT cosine beyond.  [Walter 2007, Eq. 40]
ShadingDirection refracted(const ShadingDirection& wo, const ShadingDirection& h, double mu, double muT,
                           double eta) {
  return normalized((mu / eta - muT) * h + (-1 / eta) * wo);
}

// d omega_h / d omega_i.  [Walter 2007, Eq. 17]
double facetsPerRefracted(const ShadingDirection& wi, const ShadingDirection& wo, const ShadingDirection& h,
                          double eta) {
  return eta * eta * std::abs(dot(wi, h)) / squared(dot(wo, h) + eta * dot(wi, h));
}

// f cos of L / n^2; masking on both sides is not correlated.  [Walter 2007, Eq. 21]
double transmitted(const ShadingDirection& wi, const ShadingDirection& wo, const ShadingDirection& h,
                   double eta, const Roughness& alpha) {
  return ggx::visibleDensity(h, wo, alpha) * ggx::masking(flipped(wi), alpha) *
         facetsPerRefracted(wi, wo, h, eta);
}

// x. As much lost light passes one way as the other where x_here loss_here = eta^2 x_beyond loss_beyond
// (reciprocity). It holds for 1 - meanF on both sides where both lose alike; where they do not, the geometric
// mean, and never more than there is.
double shareBeyond(double passHere, double passBeyond, double meanLossHere, double meanLossBeyond) {
  const double ratio = meanLossBeyond / meanLossHere;
  return passHere * std::min({std::sqrt(ratio), 1 / passHere, ratio / passBeyond});
}

// What does not depend on where light comes from, as seen from wo's side. Rough, wo not at the horizon.
struct View {
  View(const Dielectric& dielectric, const ShadingDirection& towards)
      : outside(isAbove(towards)), wo(outside ? towards : flipped(towards)),
        eta(outside ? dielectric.eta : 1 / dielectric.eta),
        alpha(bounded({dielectric.alpha, dielectric.alpha})),
        here(outside ? dielectric.losses->outside : dielectric.losses->inside),
        beyond(outside ? dielectric.losses->inside : dielectric.losses->outside), lost(here.loss(wo, alpha)),
        meanLossHere(here.meanLoss(alpha)), meanLossBeyond(beyond.meanLoss(alpha)) {
    assert(dielectric.losses->eta == dielectric.eta);
    const double entering = dielectric.losses->passed, leaving = entering / squared(dielectric.eta);
    x = shareBeyond(outside ? entering : leaving, outside ? leaving : entering, meanLossHere, meanLossBeyond);
  }
  // To wo's side and back.
  ShadingDirection turned(const ShadingDirection& wi) const { return outside ? wi : flipped(wi); }

  bool outside;
  ShadingDirection wo;
  double eta;
  Roughness alpha;
  const LossTable &here, &beyond;
  double lost, meanLossHere, meanLossBeyond, x = 0;
};

bool isOff(const ShadingDirection& w) { return isAbove(w) || isBelow(w); } // the horizon

bool scatters(const Dielectric& dielectric, const ShadingDirection& wi, const ShadingDirection& wo) {
  assert(isSpecular(dielectric) || dielectric.losses);
  return !isSpecular(dielectric) && isOff(wi) && isOff(wo);
}

// wi as turned() says.
double evaluate(const View& view, const ShadingDirection& wi) {
  const auto& [outside, wo, eta, alpha, here, beyond, lost, meanLossHere, meanLossBeyond, x] = view;
  if (isAbove(wi)) {
    const double F = dielectricFresnel(halfCosine(wi, wo), eta);
    const double multiple = (1 - x) * lost * here.loss(wi, alpha) / meanLossHere;
    return F * ggx::reflected(wi, wo, alpha) + multiple * cosineDensity(wi);
  }
  const double multiple = x * lost * beyond.loss(wi, alpha) / meanLossBeyond * cosineDensity(flipped(wi));
  const auto h = refractingFacet(wi, wo, eta);
  if (!h) return multiple;
  return (1 - dielectricFresnel(dot(wo, *h), eta)) * transmitted(wi, wo, *h, eta, alpha) + multiple;
}

double pdf(const View& view, const ShadingDirection& wi) {
  const auto& [outside, wo, eta, alpha, here, beyond, lost, meanLossHere, meanLossBeyond, x] = view;
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

// What a facet does with light from wo, but for what the surface hides of it.
double facetAlbedo(const ShadingDirection& wo, const ShadingDirection& h, const Roughness& alpha,
                   double eta) {
  const double mu = dot(wo, h);
  if (mu <= 0) return 0;
  const double F = dielectricFresnel(mu, eta);
  double albedo = F * ggx::unshadowed(mirrored(wo, h), wo, alpha);
  if (F < 1) {
    const ShadingDirection wi = refracted(wo, h, mu, refractedCosine(mu, eta), eta);
    if (wi.z() < 0) albedo += (1 - F) * ggx::masking(wi, alpha);
  }
  return albedo;
}

LossTable lossesFrom(double eta) {
  return LossTable([eta](const ShadingDirection& wo, const ShadingDirection& h,
                         const Roughness& alpha) { return facetAlbedo(wo, h, alpha, eta); },
                   LossTable::Shape::isotropic, LossTable::Coordinate::stretched);
}

ScatterSample sampleSmooth(double etaInside, const ShadingDirection& wo, double u) {
  const double eta = isAbove(wo) ? etaInside : 1 / etaInside, mu = std::abs(wo.z());
  if (u < dielectricFresnel(mu, eta)) return {{-wo.x(), -wo.y(), wo.z()}, {1, 1, 1}, 0, true};
  const ShadingDirection normal(0, 0, isAbove(wo) ? 1 : -1);
  return {refracted(wo, normal, mu, refractedCosine(mu, eta), eta), {1, 1, 1}, 0, true};
}

} // namespace

DielectricLosses::DielectricLosses(double etaInside)
    : eta(etaInside), passed(1 - meanDielectricFresnel(eta)), outside(lossesFrom(eta)),
      inside(lossesFrom(1 / eta)) {}

Rgb transmittance(const Rgb& absorption, double distance) {
  return byChannel(absorption, [&](double sigma) { return std::exp(-sigma * distance); });
}

bool isSpecular(const Dielectric& dielectric) { return dielectric.alpha < kSmooth; }

Rgb evaluate(const Dielectric& dielectric, const ShadingDirection& wi, const ShadingDirection& wo) {
  if (!scatters(dielectric, wi, wo)) return {};
  const View view(dielectric, wo);
  return gray(evaluate(view, view.turned(wi)));
}

double pdf(const Dielectric& dielectric, const ShadingDirection& wi, const ShadingDirection& wo) {
  if (!scatters(dielectric, wi, wo)) return 0;
  const View view(dielectric, wo);
  return pdf(view, view.turned(wi));
}

std::optional<ScatterSample> sample(const Dielectric& dielectric, const ShadingDirection& wo,
                                    const Uniforms& u) {
  if (!isOff(wo)) return std::nullopt;
  if (isSpecular(dielectric)) return sampleSmooth(dielectric.eta, wo, u[0]);
  const View view(dielectric, wo);
  ShadingDirection wi;
  bool reflects;
  if (u[0] < view.lost) {
    reflects = u[0] >= view.lost * view.x;
    wi = grazingDirection(view.alpha, u[1], u[2]);
    if (!reflects) wi = flipped(wi);
  } else {
    const ShadingDirection h = ggx::visibleNormal(view.wo, view.alpha, u[1], u[2]);
    const double mu = dot(view.wo, h), F = dielectricFresnel(mu, view.eta);
    reflects = u[0] < view.lost + (1 - view.lost) * F;
    wi = reflects ? mirrored(view.wo, h) : refracted(view.wo, h, mu, refractedCosine(mu, view.eta), view.eta);
  }
  if (reflects ? !isAbove(wi) : !isBelow(wi)) return std::nullopt; // hidden by the surface
  const double density = pdf(view, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{view.turned(wi), gray(evaluate(view, wi) / density), density};
}

} // namespace surflect
