// Surfaces with a reflectance in closed form, and photographs of them.
#pragma once

#include "srf/reflectance/photographs.h"
#include "tests/support/random.h"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::reflectance::planted {

inline constexpr float kWhite = 0.3f; // reflectance of a white pixel: about 1 / pi

// Unit vector with a third coordinate of at least `least`.
template <class T = float> Direction3<SurfelSpace, T> above(std::mt19937& random, double least = 0.1) {
  for (;;)
    if (const Vec3<double> d = randomUnit(random); d.z() >= least)
      return assume<Direction3<SurfelSpace, T>>(d.cast<T>());
}

// Matte, with a highlight of its own width along u and along v.
// [Ward 1992] Ward: Measuring and Modeling Anisotropic Reflection, SIGGRAPH. Eq. 5a
struct Material {
  Rgb matte;             // albedo
  Rgb gloss;             // specular reflectance
  double alongU, alongV; // widths of the highlight, as slopes of the half vector
};
inline const Material kMatte{{0.5f, 0.3f, 0.2f}, {0, 0, 0}, 0.3, 0.3};
inline const Material kGlossy{{0.2f, 0.2f, 0.3f}, {0.05f, 0.05f, 0.05f}, 0.15, 0.15};
inline const Material kBrushed{{0.05f, 0.05f, 0.05f}, {0.25f, 0.22f, 0.15f}, 0.12, 0.45};

// Radiance over the irradiance of a surface that faces the light.
template <class T>
Rgb reflectanceOf(const Material& material, const Direction3<SurfelSpace, T>& view,
                  const Direction3<SurfelSpace, T>& light) {
  using std::numbers::pi;
  const Vec3<double> h = (view.raw() + light.raw()).template cast<double>().normalized();
  const double u = h.x() / h.z() / material.alongU, v = h.y() / h.z() / material.alongV;
  const double lobe = std::exp(-u * u - v * v) /
                      (4 * pi * material.alongU * material.alongV * std::sqrt(double{light.z()} * view.z()));
  const auto channel = [&](float matte, float gloss) {
    return static_cast<float>(light.z() * (matte / pi + gloss * lobe));
  };
  return {channel(material.matte.r, material.gloss.r), channel(material.matte.g, material.gloss.g),
          channel(material.matte.b, material.gloss.b)};
}

// Rotation about the normal.
inline Mat3<float> aboutNormal(double angle) {
  return Eigen::AngleAxisf(static_cast<float>(angle), Vec3<float>::UnitZ()).toRotationMatrix();
}

// Adds a surfel, photographed from random directions under random lights. Its frame has the given rotation to
// the material's, whose u is along the fibres.
inline void addSurfel(PhotographArrays& to, const Material& material, const Rgb& gain, size_t photographs,
                      std::mt19937& random, const Mat3<float>& frameFromMaterial = Mat3<float>::Identity()) {
  const auto inFrame = [&](const Direction3<SurfelSpace>& direction) {
    return assume<Direction3<SurfelSpace>>(Vec3<float>(frameFromMaterial * direction.raw()));
  };
  for (size_t i = 0; i < photographs; ++i) {
    const auto view = above(random), light = above(random);
    to.add(inFrame(view), inFrame(light), gain * reflectanceOf(material, view, light));
  }
  to.endSurfel();
}

inline Rgb randomGain(std::mt19937& random) {
  std::uniform_real_distribution<float> logarithm(-0.7f, 0.7f);
  const float all = logarithm(random);
  const auto channel = [&] { return std::exp(all + 0.2f * logarithm(random)); };
  const float r = channel(), g = channel(), b = channel();
  return {r, g, b};
}

} // namespace surflect::reflectance::planted
