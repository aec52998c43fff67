// Shading space: x along the tangent (the fibre), z along the normal, which points out of the object.
//
// wo is the direction towards the camera, wi the direction towards the light; both point away from the
// surface.
#pragma once

#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace surflect::material {

struct ShadingSpace;
using ShadingDirection = Direction3<ShadingSpace, double>; // unit

// Independent uniform numbers in [0, 1): the first selects a lobe, the others a direction.
using Uniforms = std::array<double, 3>;

// A sampled direction of incident light.
struct ScatterSample {
  ShadingDirection wi;
  Rgb weight;            // evaluate / pdf, times the probability of the lobe if it is specular
  double pdf = 0;        // per steradian; 0 for a specular lobe
  bool specular = false; // wi is the lobe's only direction, which light sampling cannot find
};

inline constexpr double kPi = std::numbers::pi;

inline double squared(double x) { return x * x; }

// Directions nearer to the surface than this scatter nothing.
inline constexpr double kHorizon = 1e-9;
inline bool isAbove(const ShadingDirection& w) { return w.z() > kHorizon; }
inline bool isBelow(const ShadingDirection& w) { return w.z() < -kHorizon; }

// wi . h = wo . h for unit directions and their half vector h; positive also if they are not exactly unit.
inline double halfCosine(const ShadingDirection& wi, const ShadingDirection& wo) {
  return length(wi + wo) / 2;
}

// wo mirrored at a unit normal h.
inline ShadingDirection mirrored(const ShadingDirection& wo, const ShadingDirection& h) {
  return normalized(2 * dot(wo, h) * h + -wo);
}

inline Rgb scaled(double s, const Rgb& color) { return static_cast<float>(s) * color; }

inline Rgb gray(double value) { return scaled(value, {1, 1, 1}); }

// Applies a function to each channel.
template <class Function> Rgb byChannel(const Rgb& a, const Function& function) {
  return {static_cast<float>(function(a.r)), static_cast<float>(function(a.g)),
          static_cast<float>(function(a.b))};
}
template <class Function> Rgb byChannel(const Rgb& a, const Rgb& b, const Function& function) {
  return {static_cast<float>(function(a.r, b.r)), static_cast<float>(function(a.g, b.g)),
          static_cast<float>(function(a.b, b.b))};
}

inline double brightest(const Rgb& color) { return std::max({color.r, color.g, color.b}); }

// Cosine-weighted direction: density cos / pi.
inline ShadingDirection cosineDirection(double u, double v) {
  const double r = std::sqrt(u), phi = 2 * kPi * v;
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(1 - u)};
}
inline double cosineDensity(const ShadingDirection& w) { return std::max(0.0, w.z()) / kPi; }

// Uniform direction on the hemisphere: density 1 / (2 pi).
inline ShadingDirection hemisphereDirection(double u, double v) {
  const double z = 1 - u, r = std::sqrt(std::max(0.0, 1 - z * z)), phi = 2 * kPi * v;
  return {r * std::cos(phi), r * std::sin(phi), z};
}
inline double hemisphereDensity(const ShadingDirection& w) { return isAbove(w) ? 1 / (2 * kPi) : 0; }

} // namespace surflect::material
