// The captured lights as a place of the surface has them.
#pragma once

#include "srf/capture/rig.h"
#include "srf/ulr/choice_lanes.h"

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <variant>
#include <vector>

namespace surflect::model {

inline bool isDirectional(const capture::Light& light) {
  return std::holds_alternative<capture::DirectionalLight>(light.kind);
}

// The same direction and irradiance at every place?
inline bool isUniform(const capture::Light& light) {
  const auto* directional = std::get_if<capture::DirectionalLight>(&light.kind);
  return directional && directional->isEven();
}

// What their directions lead to.
std::vector<ulr::Source> sourcesOf(std::span<const capture::Light> lights);

// The colour of all lights, where they have the same: one over what each channel is of the strongest. Empty
// where their channels are in other proportions, by more than rounding makes of them.
struct SharedColor {
  std::optional<Rgb> inverse;
  Eigen::Index strongest = 0; // channel
};
SharedColor sharedColor(std::span<const capture::Light> lights);

// Directions and irradiances are computed where they are asked for; those of uniform lights once.
class RigLights {
public:
  explicit RigLights(std::span<const capture::Light> lights) // which must outlive this
      : lights_(lights), color_(sharedColor(lights)), towards_(lights.size()), inverse_(lights.size()),
        facedFrom_(lights.size(), 0) {
    if (!std::ranges::all_of(lights, isUniform)) return;
    faceAll();
    isFaced_ = true;
  }

  size_t size() const { return lights_.size(); }
  // Are they the same at every place, so that `ratio` is known of all of them?
  bool areUniform() const { return isFaced_; }

  void lookFrom(const Point3<AcquisitionSpace, double>& place) {
    place_ = place;
    ++current_;
  }
  // Makes what follows known of a light.
  void face(uint32_t light) {
    if (isFaced_ || facedFrom_[light] == current_) return;
    const capture::Light& captured = lights_[light];
    towards_[light] = capture::towardsLight(captured, place_).cast<float>();
    const Rgb fallen = capture::irradianceAt(captured, place_);
    const auto inverse = [](float x) { return x >= std::numeric_limits<float>::min() ? 1 / x : 0; };
    inverse_[light] = {1, inverse(fallen.r), inverse(fallen.g), inverse(fallen.b)};
    facedFrom_[light] = current_;
  }
  void faceAll() {
    for (uint32_t light = 0; light < lights_.size(); ++light) face(light);
  }

  const Point3<AcquisitionSpace, double>& place() const { return place_; }
  const Direction3<AcquisitionSpace>& towards(size_t light) const { return towards_[light]; }
  std::span<const Direction3<AcquisitionSpace>> towards() const { return towards_; }
  Rgb irradiance(size_t light) const { return capture::irradianceAt(lights_[light], place_); }
  // irradianceRatio of the last three but for a rounding, where an irradiance below the normal numbers is
  // none; the first stays as it is.
  Eigen::Array4f ratio(const Eigen::Array4f& now, size_t light) const { return now * inverse_[light]; }

  // Where all lights have one colour, that ratio is (now times the first) times the second, but for two
  // roundings more and 2^-22 of it, by which proportions may differ.
  const std::optional<Rgb>& inverseColor() const { return color_.inverse; }
  float inverseStrength(size_t light) const { return inverse_[light][1 + color_.strongest]; }

private:
  std::span<const capture::Light> lights_;
  SharedColor color_;
  std::vector<Direction3<AcquisitionSpace>> towards_; // from the current place
  std::vector<Eigen::Array4f> inverse_; // 1, and one over the irradiance there, 0 where nothing falls
  std::vector<uint64_t> facedFrom_;     // the place that the last two are of
  uint64_t current_ = 1;
  bool isFaced_ = false; // from everywhere
  Point3<AcquisitionSpace, double> place_;
};

} // namespace surflect::model
