#include "render/stage/material/clear_coat.h"

#include "render/stage/material/fresnel.h"
#include "render/stage/material/reflection.h"

#include <cassert>

namespace surflect {

namespace {

bool isSmoothCoat(const ClearCoat& coat) { return coat.alpha < kSmooth; }

Roughness roughnessOf(const ClearCoat& coat) { return bounded({coat.alpha, coat.alpha}); }

// T(w)
double passed(const ClearCoat& coat, const ShadingDirection& w) {
  if (isSmoothCoat(coat)) return 1 - dielectricFresnel(w.z(), coat.eta);
  assert(coat.transmission && coat.transmission->eta == coat.eta);
  return coat.transmission->table.loss(w, roughnessOf(coat));
}

double meanPassed(const ClearCoat& coat) {
  return isSmoothCoat(coat) ? 1 - meanDielectricFresnel(coat.eta)
                            : coat.transmission->table.meanLoss(roughnessOf(coat));
}

// Times T(wi) T(wo): light out of a Lambert base, reflected back to it any number of times.
double throughCoat(double rho, double eta, double meanT) {
  return 1 / (eta * eta * (1 - rho * (1 - meanT / (eta * eta))));
}

// To is T(wo).
Rgb baseSeenThrough(const ClearCoat& coat, const ShadingDirection& wi, const ShadingDirection& wo,
                    double To) {
  const double Ti = passed(coat, wi);
  const Rgb bare = std::visit([&](const auto& base) { return surflect::evaluate(base, wi, wo); }, coat.base);
  if (const auto* lambert = std::get_if<Lambert>(&coat.base)) {
    const double meanT = meanPassed(coat);
    return bare * byChannel(lambert->albedo,
                            [&](double rho) { return Ti * To * throughCoat(rho, coat.eta, meanT); });
  }
  return scaled(std::min(Ti, To), bare);
}

// Chance that the coat is sampled, and not the base, as if the base reflected half.
double coatShare(double T) { return (1 - T) / (1 - T + T / 2); }

// Both above.
Rgb evaluate(const ClearCoat& coat, const ShadingDirection& wi, const ShadingDirection& wo, double To) {
  const Rgb base = baseSeenThrough(coat, wi, wo, To);
  if (isSmoothCoat(coat)) return base;
  const double F = dielectricFresnel(halfCosine(wi, wo), coat.eta);
  return base + gray(F * ggx::reflected(wi, wo, roughnessOf(coat)));
}

double pdf(const ClearCoat& coat, const ShadingDirection& wi, const ShadingDirection& wo, double To) {
  const double share = coatShare(To);
  const double base = std::visit([&](const auto& b) { return surflect::pdf(b, wi, wo); }, coat.base);
  const double gloss = isSmoothCoat(coat) ? 0 : ggx::reflectedDensity(wi, wo, roughnessOf(coat));
  return share * gloss + (1 - share) * base;
}

} // namespace

CoatTransmission::CoatTransmission(double indexOfCoat)
    : eta(indexOfCoat),
      table(
          [indexOfCoat](const ShadingDirection& wo, const ShadingDirection& h, const Roughness& alpha) {
            return dielectricFresnel(std::max(0.0, dot(wo, h)), indexOfCoat) *
                   ggx::unshadowed(mirrored(wo, h), wo, alpha);
          },
          LossTable::Shape::isotropic, LossTable::Coordinate::plain) {}

Rgb evaluate(const ClearCoat& coat, const ShadingDirection& wi, const ShadingDirection& wo) {
  return isAbove(wi) && isAbove(wo) ? evaluate(coat, wi, wo, passed(coat, wo)) : Rgb{};
}

double pdf(const ClearCoat& coat, const ShadingDirection& wi, const ShadingDirection& wo) {
  return isAbove(wi) && isAbove(wo) ? pdf(coat, wi, wo, passed(coat, wo)) : 0;
}

std::optional<ScatterSample> sample(const ClearCoat& coat, const ShadingDirection& wo, const Uniforms& u) {
  if (!isAbove(wo)) return std::nullopt;
  const double T = passed(coat, wo), share = coatShare(T);
  ShadingDirection wi;
  if (u[0] < share) {
    if (isSmoothCoat(coat)) return ScatterSample{{-wo.x(), -wo.y(), wo.z()}, gray((1 - T) / share), 0, true};
    wi = mirrored(wo, ggx::visibleNormal(wo, roughnessOf(coat), u[1], u[2]));
  } else {
    const Uniforms rest{(u[0] - share) / (1 - share), u[1], u[2]};
    auto base = std::visit([&](const auto& b) { return sample(b, wo, rest); }, coat.base);
    if (!base) return std::nullopt;
    if (base->specular) { // a mirror: wi . n = wo . n
      base->weight = scaled(T / (1 - share), base->weight);
      return base;
    }
    wi = base->wi;
  }
  if (!isAbove(wi)) return std::nullopt;
  const double density = pdf(coat, wi, wo, T);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(coat, wi, wo, T)), density};
}

} // namespace surflect
