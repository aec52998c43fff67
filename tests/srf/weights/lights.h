// Rigs of lights for tests, and their weights.
#pragma once

#include "srf/weights/light_blend.h"

#include <cmath>
#include <random>
#include <span>
#include <vector>

namespace surflect::weights::lights {

using Direction = Direction3<AcquisitionSpace>;

inline Direction directionOf(const Vec3<double>& v) {
  return assume<Direction>(Vec3<float>(v.normalized().cast<float>()));
}

inline Direction randomDirection(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return directionOf({x, y, z});
}

// Directions spread evenly over the sphere above z = lowest.
inline std::vector<Direction> spiral(int count, double lowest = -1) {
  std::vector<Direction> lights;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (1 - lowest) * (i + 0.5) / count, r = std::sqrt(1 - z * z), turn = 2.399963 * i;
    lights.push_back(directionOf({r * std::cos(turn), r * std::sin(turn), z}));
  }
  return lights;
}

inline std::vector<Direction3<AcquisitionSpace, double>> inDouble(std::span<const Direction> lights) {
  std::vector<Direction3<AcquisitionSpace, double>> exact;
  for (const Direction& light : lights) exact.push_back(light.cast<double>());
  return exact;
}

inline weights::LightExtrapolationFade coverageOf(std::span<const Direction> lights) {
  return weights::LightExtrapolationFade(inDouble(lights));
}

// Weight of each light for a direction.
inline std::vector<float>
weightsOf(std::span<const Direction> lights, const Direction& towards, const weights::LightBlend& how,
          const weights::LightExtrapolationFade& coverage,
          weights::LightExtrapolation extrapolation = weights::LightExtrapolation::clamp) {
  std::vector<float> weights(lights.size());
  for (const auto& [light, weight] : weights::blendOfLights(lights, towards, how, coverage, extrapolation))
    weights[light] = weight;
  return weights;
}

inline double sumOf(std::span<const float> weights) {
  double sum = 0;
  for (const float weight : weights) sum += weight;
  return sum;
}

} // namespace surflect::weights::lights
