// Irradiance ratio: the irradiance that a light of the query brings to a surface, over the irradiance that a
// captured light brought to it. A photograph is scaled by this ratio.
//
//   ratio = E_q / E_l     foreshortening f = (c(q) + e) / (sum w_l c(l) + e)
//
// Symbols: E_q irradiance of light q of the query on the deformed surface facing it, E_l irradiance of
// captured light l at p0 on a surface facing it; w_l weights of the blended lights; n normal;
// c(l) = max(0, n . l), times the shadow state of the light where states are used; e residual.
//
// The ratio E_q / E_l is taken channel by channel. It includes no cosine of light l, since the photograph
// already contains it.
//
// Foreshortening: the irradiance of a surface falls with the cosine between light and normal, and is 0 if the
// light is behind the surface. As photographs contain the cosines of their own lights, a plain blend
// [Weyrich 2005, §5.2] shows the shadow line of every blended light, instead of a single one where the
// requested light has it. If cross-validation of the photographs favours it, a blend is multiplied by the
// cosine of the requested light over the mean cosine of the blended ones: the ratio estimator [Cochran 1977,
// §6.1], with the cosine as auxiliary variable. A matte surface is then exact up to the residual e,
// whatever the weights, as long as f does not reach its cap of 2. No single photograph is divided by its
// cosine, so noise is not amplified.
//
// [Cochran 1977] Cochran: Sampling Techniques, 3rd edition.
#pragma once

#include "srf/capture/rig.h"
#include "srf/weights/ulr.h"
#include "surfel/math/rgb.h"

#include <Eigen/Core>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::weights {

// E_q / E_l, channel by channel; 0 where E_l is 0.
Rgb irradianceRatio(Rgb now, Rgb captured);

inline float brightness(Rgb light) { return light.r + light.g + light.b; }

// c(l)
template <class T>
T foreshortenedCosine(const Normal3<AcquisitionSpace, T>& n, const Direction3<AcquisitionSpace, T>& l) {
  return std::max(T(0), dot(n, l));
}

// f, from c(q) and sum w_l c(l), for weights that sum to 1. Capped at 2, as surface and normal may disagree.
// e is the irradiance in attached shadow, a thousandth of that at normal incidence.
inline float foreshortening(float asked, float blended) {
  constexpr float kResidual = 1e-3f, kMost = 2;
  return std::min(kMost, (asked + kResidual) / (std::max(0.f, blended) + kResidual));
}

// sum w_l c(l) / sum w_l, with c(l) in `cosines` for every light; 0 if there are no weights.
template <class Cosines> float blendedCosine(const BlendSet& blend, const Cosines& cosines) {
  float sum = 0, weights = 0;
  for (const auto& [light, weight] : blend) {
    sum += weight * cosines[light];
    weights += weight;
  }
  return weights > 0 ? sum / weights : 0;
}

// Part of a light between captured ones that reaches a surfel, by the shadow states s of those it is blended
// from:
//   V = min(1, sum w_l) (sum w_l s_l c(l) + e) / (sum w_l c(l) + e),   within 0..1
// Here c(l) has no shadow state. Captured lights behind the surface say nothing of cast shadows. Weights sum
// to less than 1 where no light was captured.
struct ReachedPart {
  float weights = 0, cosines = 0, lit = 0; // sums of w_l, w_l c(l) and w_l s_l c(l)

  void add(float weight, float cosine, float state) {
    weights += weight;
    cosines += weight * cosine;
    lit += weight * cosine * state;
  }
  float value() const {
    constexpr float kResidual = 1e-3f;
    const float reached = (std::max(0.f, lit) + kResidual) / (std::max(0.f, cosines) + kResidual);
    return std::clamp(weights, 0.f, 1.f) * std::min(1.f, reached);
  }
};

// Common colour of several lights: the strongest channel divided by each channel. Empty if the channels of
// two lights differ in proportion by more than rounding.
struct SharedColor {
  std::optional<Rgb> inverse;
  Eigen::Index strongest = 0; // channel
};
SharedColor sharedColor(std::span<const capture::Light> lights);

// Directions and irradiances of the captured lights at one place, evaluated on demand; values that are the
// same at every place are evaluated once.
class CapturedLights {
public:
  explicit CapturedLights(std::span<const capture::Light> lights); // lights must outlive this

  size_t size() const { return lights_.size(); }
  // Returns true if all lights have the same direction and irradiance at every place; all are then evaluated
  // from the start.
  bool areUniform() const { return areUniform_; }

  void moveTo(const Point3<AcquisitionSpace, double>& place) {
    place_ = place;
    ++current_;
  }
  void evaluate(uint32_t light) {
    if (!areUniform_ && evaluatedAt_[light] != current_) compute(light);
  }
  void evaluateAll() {
    for (uint32_t light = 0; light < lights_.size(); ++light) evaluate(light);
  }

  const Point3<AcquisitionSpace, double>& place() const { return place_; }
  Rgb irradiance(size_t light) const { return capture::irradianceAt(lights_[light], place_); }

  // The methods below require evaluated lights.
  const Direction3<AcquisitionSpace>& towards(size_t light) const { return towards_[light]; }
  std::span<const Direction3<AcquisitionSpace>> towards() const { return towards_; }
  // Replaces the last three numbers of `now` by their irradianceRatio to the captured light, up to one
  // rounding; the first number is kept. A captured irradiance below the normal floats counts as 0.
  Eigen::Array4f ratio(const Eigen::Array4f& now, size_t light) const { return now * inverse_[light]; }

  // If all lights have one colour, the ratio is now * inverseColor * inverseStrength, up to two more
  // roundings and the 2^-22 by which proportions may differ.
  const std::optional<Rgb>& inverseColor() const { return color_.inverse; }
  float inverseStrength(size_t light) const { return inverse_[light][1 + color_.strongest]; }

private:
  void compute(uint32_t light);

  std::span<const capture::Light> lights_;
  SharedColor color_;
  std::vector<Direction3<AcquisitionSpace>> towards_;
  std::vector<Eigen::Array4f> inverse_; // 1, then 1 / irradiance of each channel, 0 where that is 0
  std::vector<uint64_t> evaluatedAt_;   // number of the place at which each light was evaluated
  uint64_t current_ = 1;                // number of the current place
  bool areUniform_ = false;
  Point3<AcquisitionSpace, double> place_;
};

} // namespace surflect::weights
