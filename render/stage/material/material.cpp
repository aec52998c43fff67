#include "render/stage/material/material.h"

#include "surfel/base/error.h"

#include <cassert>
#include <cstdint>
#include <string>

namespace surflect::material {

namespace {

void requireFraction(double value, std::string_view field) {
  if (!(value >= 0 && value <= 1)) throw Error::mismatch("0 to 1", numberText(value)).at(field);
}

void requireFractions(const Rgb& color, std::string_view field) {
  for (const float value : {color.r, color.g, color.b}) requireFraction(value, field);
}

void requireRoughness(const Roughness& alpha) {
  requireFraction(alpha.x, "alpha.x");
  requireFraction(alpha.y, "alpha.y");
}

void requireAbsorption(const Rgb& absorption, std::string_view field) {
  for (const float sigma : {absorption.r, absorption.g, absorption.b})
    if (!(sigma >= 0 && std::isfinite(sigma)))
      throw Error::mismatch("0 or more", numberText(sigma)).at(field);
}

void require(const Lambert& m) { requireFractions(m.albedo, "albedo"); }

void require(const RoughDiffuse& m) {
  requireFractions(m.albedo, "albedo");
  requireFraction(m.roughness, "roughness");
}

void require(const Conductor& m) {
  requireFractions(m.color, "color");
  requireFractions(m.grazingTint, "grazingTint");
  requireRoughness(m.alpha);
  assert(isSpecular(m) || m.mirrorLoss);
}

void require(const Dielectric& m) {
  requireFraction(m.alpha, "alpha");
  if (!(m.eta >= 0.2 && m.eta <= 5 && std::abs(m.eta - 1) >= 1e-3))
    throw Error::mismatch("0.2 to 5 and not 1", numberText(m.eta)).at("eta");
  requireAbsorption(m.absorption, "absorption");
  requireAbsorption(m.absorptionOutside, "absorptionOutside");
  assert(isSpecular(m) || (m.losses && m.losses->eta == m.eta));
}

void require(const Ward& m) {
  requireFractions(m.diffuse, "diffuse");
  requireFractions(m.specular, "specular");
  requireFractions(m.diffuse + m.specular, "diffuse + specular");
  requireRoughness(m.alpha);
}

void require([[maybe_unused]] const Measured& m) { assert(m.table); }

void require(const ClearCoat& m) {
  requireFraction(m.alpha, "alpha");
  if (!(m.eta >= 1.001 && m.eta <= 5)) throw Error::mismatch("1.001 to 5", numberText(m.eta)).at("eta");
  assert(m.alpha < kSmooth || (m.transmission && m.transmission->eta == m.eta));
  try {
    std::visit([](const auto& base) { require(base); }, m.base);
  } catch (Error& e) {
    throw std::move(e).at("base");
  }
}

// Van der Corput sequence: the digits of i mirrored at the radix point.
double radicalInverse(uint32_t i, uint32_t base) {
  double value = 0, digit = 1;
  for (; i > 0; i /= base) value += (i % base) * (digit /= base);
  return value;
}

} // namespace

void requireValid(const Material& material) {
  std::visit([](const auto& m) { require(m); }, material);
}

Bsdf bsdfAt(const ShadingDirection& wo, const Material& material) {
  return std::visit([&]<class Kind>(const Kind& m) -> Bsdf { return typename Kind::Bsdf(m, wo); }, material);
}

void evaluate(const Bsdf& bsdf, std::span<const ShadingDirection> wi, std::span<Rgb> values) {
  assert(wi.size() == values.size());
  std::visit(
      [&](const auto& v) {
        for (size_t i = 0; i < wi.size(); ++i) values[i] = evaluate(v, wi[i]);
      },
      bsdf);
}

void pdf(const Bsdf& bsdf, std::span<const ShadingDirection> wi, std::span<double> densities) {
  assert(wi.size() == densities.size());
  std::visit(
      [&](const auto& v) {
        for (size_t i = 0; i < wi.size(); ++i) densities[i] = pdf(v, wi[i]);
      },
      bsdf);
}

std::optional<ScatterSample> sample(const Bsdf& bsdf, const Uniforms& u) {
  return std::visit([&](const auto& v) { return sample(v, u); }, bsdf);
}

Rgb evaluate(const Material& material, const ShadingDirection& wi, const ShadingDirection& wo) {
  return std::visit([&](const auto& m) { return evaluate(m, wi, wo); }, material);
}

double pdf(const Material& material, const ShadingDirection& wi, const ShadingDirection& wo) {
  return std::visit([&](const auto& m) { return pdf(m, wi, wo); }, material);
}

std::optional<ScatterSample> sample(const Material& material, const ShadingDirection& wo, const Uniforms& u) {
  return std::visit([&](const auto& m) { return sample(m, wo, u); }, material);
}

bool isSpecular(const Material& material) {
  if (const auto* conductor = std::get_if<Conductor>(&material)) return isSpecular(*conductor);
  if (const auto* dielectric = std::get_if<Dielectric>(&material)) return isSpecular(*dielectric);
  if (const auto* coat = std::get_if<ClearCoat>(&material)) {
    const auto* base = std::get_if<Conductor>(&coat->base);
    return coat->alpha < kSmooth && base && isSpecular(*base);
  }
  return false;
}

Rgb albedo(const Material& material, const ShadingDirection& wo, int count) {
  Vec3<double> sum = Vec3<double>::Zero();
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<uint32_t>(i);
    const auto s =
        sample(material, wo, {(i + 0.5) / count, radicalInverse(index, 2), radicalInverse(index, 3)});
    if (s) sum += Vec3<double>(s->weight.r, s->weight.g, s->weight.b);
  }
  sum /= count;
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

} // namespace surflect::material
