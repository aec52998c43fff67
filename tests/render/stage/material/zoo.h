// One of each kind of material, and several where roughness matters.
#pragma once

#include "render/stage/material/material.h"
#include "tests/srf/image/files.h"

#include <functional>
#include <random>
#include <string>
#include <vector>

namespace surflect::zoo {

// Made by the first test that asks.
inline const EnergyCompensation& mirrorLoss() {
  static const EnergyCompensation table = mirrorEnergyCompensation();
  return table;
}
inline const DielectricLosses& glassLosses() {
  static const DielectricLosses losses(1.5);
  return losses;
}
inline const CoatTransmission& coatTransmission() {
  static const CoatTransmission transmission(1.5);
  return transmission;
}

// A file of the MERL database from f(theta_h, theta_d, phi_d) at the middles of bins.
inline std::string merlFile(const std::function<std::array<double, 3>(double, double, double)>& f) {
  constexpr size_t h = MerlTable::kThetaH, d = MerlTable::kThetaD, p = MerlTable::kPhiD;
  constexpr std::array scales{1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
  const std::array<int32_t, 3> dimensions{h, d, p};
  std::vector<double> values(3 * h * d * p);
  for (size_t i = 0; i < h; ++i)
    for (size_t j = 0; j < d; ++j)
      for (size_t k = 0; k < p; ++k) {
        const auto rgb =
            f(kPi / 2 * squared((static_cast<double>(i) + 0.5) / h),
              kPi / 2 * (static_cast<double>(j) + 0.5) / d, kPi * (static_cast<double>(k) + 0.5) / p);
        for (size_t c = 0; c < 3; ++c) values[((c * h + i) * d + j) * p + k] = rgb[c] / scales[c];
      }
  std::string bytes(sizeof dimensions + values.size() * sizeof(double), '\0');
  std::memcpy(bytes.data(), dimensions.data(), sizeof dimensions);
  std::memcpy(bytes.data() + sizeof dimensions, values.data(), values.size() * sizeof(double));
  return bytes;
}

inline MerlTable merlTable(const std::function<std::array<double, 3>(double, double, double)>& f) {
  const TemporaryFolder folder;
  writeBytes(folder / "made.binary", merlFile(f));
  return MerlTable(folder / "made.binary");
}

// A red gloss, brighter towards the light and at grazing angles, that depends on all three angles.
inline const MerlTable& glossyMeasurement() {
  static const MerlTable table = merlTable([](double h, double d, double p) {
    const double gloss = 2 * std::exp(-squared(std::tan(h) / 0.3)) * (1 + std::pow(d, 3)) / 4;
    const double base = 0.1 * (1 + 0.5 * std::sin(2 * p + 1) * std::sin(d));
    return std::array{gloss + base, 0.5 * gloss + base, base};
  });
  return table;
}

inline Material conductor(double x, double y, const Rgb& color = {1, 1, 1}, const Rgb& tint = {1, 1, 1}) {
  return Conductor{color, tint, {x, y}, &mirrorLoss()};
}
inline Material glass(double alpha) { return Dielectric{1.5, alpha, {}, &glassLosses()}; }
inline Material coat(double alpha, const CoatBase& base) {
  return ClearCoat{1.5, alpha, base, &coatTransmission()};
}

struct Named {
  std::string name;
  Material material;
};

inline std::vector<Named> all() {
  const Rgb red{0.9f, 0.3f, 0.1f};
  const Conductor brushed{red, {0.7f, 0.9f, 1}, {0.1, 0.4}, &mirrorLoss()};
  const Ward gloss{{0.3f, 0.2f, 0.1f}, {0.5f, 0.6f, 0.7f}, {0.2, 0.2}};
  return {{"lambert", Lambert{red}},
          {"rough diffuse", RoughDiffuse{red, 0.5}},
          {"rough diffuse, most", RoughDiffuse{red, 1}},
          {"conductor 0.05", conductor(0.05, 0.05)},
          {"conductor 0.3, tinted", conductor(0.3, 0.3, red, {0.2f, 0.5f, 0.9f})},
          {"conductor 1", conductor(1, 1)},
          {"brushed", brushed},
          {"fibre", conductor(0.05, 0.6)},
          {"glass 0.05", glass(0.05)},
          {"glass 0.3", glass(0.3)},
          {"glass 1", glass(1)},
          {"ward", gloss},
          {"ward, brushed", Ward{{0, 0, 0}, {1, 1, 1}, {0.1, 0.5}}},
          {"measured", Measured{&glossyMeasurement()}},
          {"varnished lambert", coat(0, Lambert{red})},
          {"plastic", coat(0.2, Lambert{red})},
          {"coated rough diffuse", coat(0.1, RoughDiffuse{red, 1})},
          {"coated metal", coat(0.3, brushed)},
          {"coated gloss", coat(0, gloss)}};
}

inline ShadingDirection at(double mu, double azimuth) {
  const double r = std::sqrt(std::max(0.0, 1 - mu * mu));
  return {r * std::cos(azimuth), r * std::sin(azimuth), mu};
}

// Even over the sphere.
inline ShadingDirection randomDirection(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double z = 2 * uniform(random) - 1;
  return at(z, 2 * kPi * uniform(random));
}

inline Uniforms randomUniforms(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double a = uniform(random), b = uniform(random), c = uniform(random);
  return {a, b, c};
}

// Glass scatters towards both sides, whence also wo below.
inline bool isTwoSided(const Material& material) { return std::holds_alternative<Dielectric>(material); }

} // namespace surflect::zoo
