#include "render/stage/material/clear_coat.h"

#include "render/stage/material/fresnel.h"
#include "render/stage/material/ggx.h"

#include <cassert>

namespace surflect::material {

namespace {

using BaseView = decltype(ClearCoatBsdf::base);

BaseView viewOf(const CoatBase& base, const ShadingDirection& wo) {
  return std::visit([&]<class Base>(const Base& b) -> BaseView { return typename Base::Bsdf(b, wo); }, base);
}

// Transmittance T(w)
double passed(const ClearCoatBsdf& bsdf, const ShadingDirection& w) {
  return bsdf.isSmooth ? 1 - dielectricFresnel(w.z(), bsdf.eta) : bsdf.coatT.loss(w);
}

// Factor beside T(wi) T(wo) for light that a Lambert base and the coat reflect any number of times.
double throughCoat(double rho, double eta, double meanT) {
  return 1 / (eta * eta * (1 - rho * (1 - meanT / (eta * eta))));
}

Rgb baseSeenThrough(const ClearCoatBsdf& bsdf, const ShadingDirection& wi) {
  const double Ti = passed(bsdf, wi);
  const Rgb bare = std::visit([&](const auto& base) { return evaluate(base, wi); }, bsdf.base);
  if (std::holds_alternative<LambertBsdf>(bsdf.base)) return bare * scaled(Ti * bsdf.To, bsdf.throughCoat);
  return scaled(std::min(Ti, bsdf.To), bare);
}

// Probability of sampling the coat instead of the base, as if the base reflected half.
double coatShare(double T) { return (1 - T) / (1 - T + T / 2); }

} // namespace

CoatTransmission::CoatTransmission(double indexOfCoat)
    : eta(indexOfCoat),
      table(
          [indexOfCoat](const ShadingDirection& wo, const ShadingDirection& h, const Roughness& alpha) {
            return dielectricFresnel(std::max(0.0, dot(wo, h)), indexOfCoat) *
                   ggx::unshadowed(mirrored(wo, h), wo, alpha);
          },
          EnergyCompensation::Shape::isotropic, EnergyCompensation::Coordinate::plain) {}

ClearCoatBsdf::ClearCoatBsdf(const ClearCoat& coat, const ShadingDirection& towards)
    : eta(coat.eta), isSmooth(coat.alpha < kSmooth), wo(towards), alpha(bounded({coat.alpha, coat.alpha})),
      base(viewOf(coat.base, towards)) {
  if (!isAbove(wo)) return;
  if (!isSmooth) {
    assert(coat.transmission && coat.transmission->eta == coat.eta);
    coatT = coat.transmission->table.at(alpha);
  }
  To = passed(*this, wo);
  if (const auto* lambert = std::get_if<Lambert>(&coat.base)) {
    const double meanT = isSmooth ? 1 - meanDielectricFresnel(eta) : coatT.meanLoss;
    throughCoat = byChannel(lambert->albedo,
                            [&](double rho) { return surflect::material::throughCoat(rho, eta, meanT); });
  }
}

Rgb evaluate(const ClearCoatBsdf& bsdf, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(bsdf.wo)) return {};
  const Rgb base = baseSeenThrough(bsdf, wi);
  if (bsdf.isSmooth) return base;
  const double F = dielectricFresnel(halfCosine(wi, bsdf.wo), bsdf.eta);
  return base + gray(F * ggx::reflected(wi, bsdf.wo, bsdf.alpha));
}

double pdf(const ClearCoatBsdf& bsdf, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(bsdf.wo)) return 0;
  const double share = coatShare(bsdf.To);
  const double base = std::visit([&](const auto& b) { return pdf(b, wi); }, bsdf.base);
  const double gloss = bsdf.isSmooth ? 0 : ggx::reflectedDensity(wi, bsdf.wo, bsdf.alpha);
  return share * gloss + (1 - share) * base;
}

std::optional<ScatterSample> sample(const ClearCoatBsdf& bsdf, const Uniforms& u) {
  const ShadingDirection& wo = bsdf.wo;
  if (!isAbove(wo)) return std::nullopt;
  const double T = bsdf.To, share = coatShare(T);
  ShadingDirection wi;
  if (u[0] < share) {
    if (bsdf.isSmooth) return ScatterSample{{-wo.x(), -wo.y(), wo.z()}, gray((1 - T) / share), 0, true};
    wi = mirrored(wo, ggx::visibleNormal(wo, bsdf.alpha, u[1], u[2]));
  } else {
    const Uniforms rest{(u[0] - share) / (1 - share), u[1], u[2]};
    auto base = std::visit([&](const auto& b) { return sample(b, rest); }, bsdf.base);
    if (!base) return std::nullopt;
    if (base->specular) { // mirror base: wi . n = wo . n
      base->weight = scaled(T / (1 - share), base->weight);
      return base;
    }
    wi = base->wi;
  }
  if (!isAbove(wi)) return std::nullopt;
  const double density = pdf(bsdf, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(bsdf, wi)), density};
}

} // namespace surflect::material
