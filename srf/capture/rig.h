// Lights of a capture and their irradiance at a point.
//
// Lights keep their captured strength, so that a look-up can divide by the irradiance at capture time.
#pragma once

#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

namespace surflect::capture {

// Limits of a capture's coordinates and strengths. Beyond them, products and squares in float overflow or
// vanish.
inline constexpr double kFarthest = 1e12; // coordinates in scene units, principal points in pixels
// Irradiance and intensity, in each channel.
inline constexpr float kLeastStrength = 1e-12f, kMostStrength = 1e12f;

// Light of one direction everywhere. Its strength may vary over the object, as with near lamps or narrow
// beams.
struct DirectionalLight {
  Direction3<AcquisitionSpace, double> towards; // unit, from the object to the light
  Rgb irradiance;                               // at the origin, facing it; each channel above 0
  Vec3<double> irradianceGradient = {0, 0, 0};  // gradient of the logarithm, per scene unit along x, y and z

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
  std::string
      identity; // identity that makes two lights the same: the cluster if there is one, otherwise the name
  std::variant<DirectionalLight, PointLight> kind;

  friend bool operator==(const Light&, const Light&) = default;
};

// Unit direction from a point, not the light's own position, towards the light.
inline Direction3<AcquisitionSpace, double> towardsLight(const Light& light,
                                                         const Point3<AcquisitionSpace, double>& p0) {
  if (const auto* directional = std::get_if<DirectionalLight>(&light.kind)) return directional->towards;
  return normalized(std::get<PointLight>(light.kind).position - p0);
}

// Irradiance at a place over that at the origin, e^(gradient . place), clamped to [e^-3, e^3] (1/20 to 20) so
// that no light vanishes for any gradient in a file.
inline double gainAt(const Vec3<double>& irradianceGradient, const Vec3<double>& place) {
  constexpr double kMost = 3;
  return std::exp(std::clamp(irradianceGradient.dot(place), -kMost, kMost));
}

// Irradiance of a surface at p0 that faces the light: E e^(gradient . p0) for a directional light, I / d^2
// for a point light.
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
