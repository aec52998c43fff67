// One of each kind of material, and several where roughness matters.
#pragma once

#include "render/stage/material/material.h"
#include "tests/srf/image/files.h"

#include <functional>
#include <random>
#include <string>
#include <vector>

namespace surflect::material::zoo {

// Made by the first test that asks.
inline const material::EnergyCompensation& mirrorLoss() {
  static const material::EnergyCompensation table = material::mirrorEnergyCompensation();
  return table;
}
inline const material::DielectricLosses& glassLosses() {
  static const material::DielectricLosses losses(1.5);
  return losses;
}
inline const material::CoatTransmission& coatTransmission() {
  static const material::CoatTransmission transmission(1.5);
  return transmission;
}

// A file of the MERL database from f(theta_h, theta_d, phi_d) at the middles of bins.
inline std::string merlFile(const std::function<std::array<double, 3>(double, double, double)>& f) {
  constexpr size_t h = material::MerlTable::kThetaH, d = material::MerlTable::kThetaD,
                   p = material::MerlTable::kPhiD;
  constexpr std::array scales{1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
  const std::array<int32_t, 3> dimensions{h, d, p};
  std::vector<double> values(3 * h * d * p);
  for (size_t i = 0; i < h; ++i)
    for (size_t j = 0; j < d; ++j)
      for (size_t k = 0; k < p; ++k) {
        const auto rgb = f(material::kPi / 2 * material::squared((static_cast<double>(i) + 0.5) / h),
                           material::kPi / 2 * (static_cast<double>(j) + 0.5) / d,
                           material::kPi * (static_cast<double>(k) + 0.5) / p);
        for (size_t c = 0; c < 3; ++c) values[((c * h + i) * d + j) * p + k] = rgb[c] / scales[c];
      }
  std::string bytes(sizeof dimensions + values.size() * sizeof(double), '\0');
  std::memcpy(bytes.data(), dimensions.data(), sizeof dimensions);
  std::memcpy(bytes.data() + sizeof dimensions, values.data(), values.size() * sizeof(double));
  return bytes;
}

inline material::MerlTable merlTable(const std::function<std::array<double, 3>(double, double, double)>& f) {
  const image::TemporaryFolder folder;
  image::writeBytes(folder / "made.binary", merlFile(f));
  return material::MerlTable(folder / "made.binary");
}

// A red gloss, brighter towards the light and at grazing angles, that depends on all three angles.
inline const material::MerlTable& glossyMeasurement() {
  static const material::MerlTable table = merlTable([](double h, double d, double p) {
    const double gloss = 2 * std::exp(-material::squared(std::tan(h) / 0.3)) * (1 + std::pow(d, 3)) / 4;
    const double base = 0.1 * (1 + 0.5 * std::sin(2 * p + 1) * std::sin(d));
    return std::array{gloss + base, 0.5 * gloss + base, base};
  });
  return table;
}

inline material::Material conductor(double x, double y, const Rgb& color = {1, 1, 1},
                                    const Rgb& tint = {1, 1, 1}) {
  return material::Conductor{color, tint, {x, y}, &mirrorLoss()};
}
inline material::Material glass(double alpha) { return material::Dielectric{1.5, alpha, {}, &glassLosses()}; }
inline material::Material coat(double alpha, const material::CoatBase& base) {
  return material::ClearCoat{1.5, alpha, base, &coatTransmission()};
}

struct Named {
  std::string name;
  material::Material material;
};

inline std::vector<Named> all() {
  const Rgb red{0.9f, 0.3f, 0.1f};
  const material::Conductor brushed{red, {0.7f, 0.9f, 1}, {0.1, 0.4}, &mirrorLoss()};
  const material::Ward gloss{{0.3f, 0.2f, 0.1f}, {0.5f, 0.6f, 0.7f}, {0.2, 0.2}};
  return {{"lambert", material::Lambert{red}},
          {"rough diffuse", material::RoughDiffuse{red, 0.5}},
          {"rough diffuse, most", material::RoughDiffuse{red, 1}},
          {"conductor 0.05", conductor(0.05, 0.05)},
          {"conductor 0.3, tinted", conductor(0.3, 0.3, red, {0.2f, 0.5f, 0.9f})},
          {"conductor 1", conductor(1, 1)},
          {"brushed", brushed},
          {"fibre", conductor(0.05, 0.6)},
          {"glass 0.05", glass(0.05)},
          {"glass 0.3", glass(0.3)},
          {"glass 1", glass(1)},
          {"ward", gloss},
          {"ward, brushed", material::Ward{{0, 0, 0}, {1, 1, 1}, {0.1, 0.5}}},
          {"measured", material::Measured{&glossyMeasurement()}},
          {"varnished lambert", coat(0, material::Lambert{red})},
          {"plastic", coat(0.2, material::Lambert{red})},
          {"coated rough diffuse", coat(0.1, material::RoughDiffuse{red, 1})},
          {"coated metal", coat(0.3, brushed)},
          {"coated gloss", coat(0, gloss)}};
}

inline material::ShadingDirection at(double mu, double azimuth) {
  const double r = std::sqrt(std::max(0.0, 1 - mu * mu));
  return {r * std::cos(azimuth), r * std::sin(azimuth), mu};
}

// Even over the sphere.
inline material::ShadingDirection randomDirection(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double z = 2 * uniform(random) - 1;
  return at(z, 2 * material::kPi * uniform(random));
}

inline material::Uniforms randomUniforms(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double a = uniform(random), b = uniform(random), c = uniform(random);
  return {a, b, c};
}

// Glass scatters towards both sides, whence also wo below.
inline bool isTwoSided(const material::Material& material) {
  return std::holds_alternative<material::Dielectric>(material);
}

} // namespace surflect::material::zoo
