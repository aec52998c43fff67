#include "render/stage/material/clear_coat.h"

#include "render/stage/material/fresnel.h"
#include "render/stage/material/reflection.h"

#include <cassert>

namespace surflect {

namespace {

using BaseView = decltype(ClearCoatView::base);

BaseView viewOf(const CoatBase& base, const ShadingDirection& wo) {
  return std::visit([&]<class Base>(const Base& b) -> BaseView { return typename Base::View(b, wo); }, base);
}

// T(w)
double passed(const ClearCoatView& view, const ShadingDirection& w) {
  return view.isSmooth ? 1 - dielectricFresnel(w.z(), view.eta) : view.coatT.loss(w);
}

// Times T(wi) T(wo): light out of a Lambert base, reflected back to it any number of times.
double throughCoat(double rho, double eta, double meanT) {
  return 1 / (eta * eta * (1 - rho * (1 - meanT / (eta * eta))));
}

Rgb baseSeenThrough(const ClearCoatView& view, const ShadingDirection& wi) {
  const double Ti = passed(view, wi);
  const Rgb bare = std::visit([&](const auto& base) { return evaluate(base, wi); }, view.base);
  if (std::holds_alternative<LambertView>(view.base)) return bare * scaled(Ti * view.To, view.throughCoat);
  return scaled(std::min(Ti, view.To), bare);
}

// Chance that the coat is sampled, and not the base, as if the base reflected half.
double coatShare(double T) { return (1 - T) / (1 - T + T / 2); }

} // namespace

CoatTransmission::CoatTransmission(double indexOfCoat)
    : eta(indexOfCoat),
      table(
          [indexOfCoat](const ShadingDirection& wo, const ShadingDirection& h, const Roughness& alpha) {
            return dielectricFresnel(std::max(0.0, dot(wo, h)), indexOfCoat) *
                   ggx::unshadowed(mirrored(wo, h), wo, alpha);
          },
          LossTable::Shape::isotropic, LossTable::Coordinate::plain) {}

ClearCoatView::ClearCoatView(const ClearCoat& coat, const ShadingDirection& towards)
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
    throughCoat =
        byChannel(lambert->albedo, [&](double rho) { return surflect::throughCoat(rho, eta, meanT); });
  }
}

Rgb evaluate(const ClearCoatView& view, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(view.wo)) return {};
  const Rgb base = baseSeenThrough(view, wi);
  if (view.isSmooth) return base;
  const double F = dielectricFresnel(halfCosine(wi, view.wo), view.eta);
  return base + gray(F * ggx::reflected(wi, view.wo, view.alpha));
}

double pdf(const ClearCoatView& view, const ShadingDirection& wi) {
  if (!isAbove(wi) || !isAbove(view.wo)) return 0;
  const double share = coatShare(view.To);
  const double base = std::visit([&](const auto& b) { return pdf(b, wi); }, view.base);
  const double gloss = view.isSmooth ? 0 : ggx::reflectedDensity(wi, view.wo, view.alpha);
  return share * gloss + (1 - share) * base;
}

std::optional<ScatterSample> sample(const ClearCoatView& view, const Uniforms& u) {
  const ShadingDirection& wo = view.wo;
  if (!isAbove(wo)) return std::nullopt;
  const double T = view.To, share = coatShare(T);
  ShadingDirection wi;
  if (u[0] < share) {
    if (view.isSmooth) return ScatterSample{{-wo.x(), -wo.y(), wo.z()}, gray((1 - T) / share), 0, true};
    wi = mirrored(wo, ggx::visibleNormal(wo, view.alpha, u[1], u[2]));
  } else {
    const Uniforms rest{(u[0] - share) / (1 - share), u[1], u[2]};
    auto base = std::visit([&](const auto& b) { return sample(b, rest); }, view.base);
    if (!base) return std::nullopt;
    if (base->specular) { // a mirror: wi . n = wo . n
      base->weight = scaled(T / (1 - share), base->weight);
      return base;
    }
    wi = base->wi;
  }
  if (!isAbove(wi)) return std::nullopt;
  const double density = pdf(view, wi);
  if (!(density > 0)) return std::nullopt;
  return ScatterSample{wi, scaled(1 / density, evaluate(view, wi)), density};
}

} // namespace surflect
