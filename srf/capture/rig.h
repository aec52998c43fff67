// The lights a capture was made with, and what they do at a point.
//
// Lights keep their captured strength, so that a look-up can divide by what fell on the surface then.
#pragma once

#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

namespace surflect::capture {

// From one direction everywhere. Its strength may change over the object, as that of near lamps and of narrow
// beams does.
struct DirectionalLight {
  Direction3<AcquisitionSpace, double> towards; // unit, from the object to the light
  Rgb irradiance;                               // at the origin, facing it; each channel above 0
  Vec3<double> irradianceGradient = {0, 0, 0};  // of its logarithm, per scene unit along x, y and z

  bool isEven() const { return irradianceGradient.isZero(0); }

  friend bool operator==(const DirectionalLight&, const DirectionalLight&) = default;
};

struct PointLight {
  Point3<AcquisitionSpace, double> position;
  Rgb intensity; // irradiance at distance 1; each channel above 0

  friend bool operator==(const PointLight&, const PointLight&) = default;
};

struct Light {
  std::string name;
  std::string identity; // what makes two lights the same light: its cluster where it has one, else its name
  std::variant<DirectionalLight, PointLight> kind;

  friend bool operator==(const Light&, const Light&) = default;
};

// Unit direction from a point (not the light's own) towards the light.
inline Direction3<AcquisitionSpace, double> towardsLight(const Light& light,
                                                         const Point3<AcquisitionSpace, double>& p0) {
  if (const auto* directional = std::get_if<DirectionalLight>(&light.kind)) return directional->towards;
  return normalized(std::get<PointLight>(light.kind).position - p0);
}

// Irradiance at a place over that at the origin of the same space, e^(gradient . place), but no more than e^3
// (20) times or that share, so that no light goes out, whatever a file says.
inline double gainAt(const Vec3<double>& irradianceGradient, const Vec3<double>& place) {
  constexpr double kMost = 3;
  return std::exp(std::clamp(irradianceGradient.dot(place), -kMost, kMost));
}

// What falls on a surface at p0 that faces the light: E e^(gradient . p0) of a directional light, I / d^2 of
// a point light.
inline Rgb irradianceAt(const Light& light, const Point3<AcquisitionSpace, double>& p0) {
  if (const auto* directional = std::get_if<DirectionalLight>(&light.kind)) {
    if (directional->isEven()) return directional->irradiance;
    return static_cast<float>(gainAt(directional->irradianceGradient, p0.raw())) * directional->irradiance;
  }
  const auto& point = std::get<PointLight>(light.kind);
  const auto toLight = point.position - p0;
  return static_cast<float>(1 / dot(toLight, toLight)) * point.intensity;
}

} // namespace surflect::capture
