// How much light single scattering by microfacets loses, tabulated over direction and roughness, and the
// directions in which to give it back.
//
// [Kulla 2017] Kulla, Conty: Revisiting physically based shading at Imageworks, SIGGRAPH courses. A lobe
//   loss(wo) loss(wi) / (pi meanLoss)
// reflects what is lost. It is reciprocal whatever the error of the table.
#pragma once

#include "render/stage/material/ggx.h"

#include <functional>
#include <vector>

namespace surflect::material {

// What share of light a facet h lets arrive that is seen from wo, above the surface.
using FacetAlbedo =
    std::function<double(const ShadingDirection& wo, const ShadingDirection& h, const Roughness& alpha)>;

// Its mean over the facets that wo sees, by a fixed rule of 40 x 40 of them; to about 0.001.
double averageOverFacets(const ShadingDirection& wo, const Roughness& alpha, const FacetAlbedo& albedo);

// A EnergyCompensation at one roughness.
class LossesAtRoughness {
public:
  double meanLoss = 0; // see EnergyCompensation

  // See EnergyCompensation.
  double loss(const ShadingDirection& w) const;

private:
  friend class EnergyCompensation;
  static constexpr int kMostNodes = 48;

  Roughness stretch_;                  // the directions are those of the table's coordinate
  int directions_ = 0, azimuths_ = 0;  // nodes; of one azimuth the same all round
  bool turned_ = false;                // azimuth is that to y
  std::array<float, kMostNodes> rows_; // directions fastest
};

// Made once and shared by all materials that look something up in it; queries are const and need no locks.
class EnergyCompensation {
public:
  enum class Shape { isotropic, anisotropic };
  // Over what the table is even: the cosine where loss comes from Fresnel's law, or that in the space in
  // which the facets are a hemisphere, where it comes from masking.
  enum class Coordinate { plain, stretched };

  // The loss is 1 - averageOverFacets. Uses all cores; the same bits for any number of them.
  EnergyCompensation(const FacetAlbedo& albedo, Shape shape, Coordinate coordinate);

  // At a roughness, to be asked for many directions.
  LossesAtRoughness at(const Roughness& alpha) const;

  // Of light that leaves towards w, on either side, within 0.004; of roughnesses as bounded() gives them.
  // Isotropic tables read alpha.x. Where one roughness is less than a fiftieth of the other it is taken for
  // that.
  double loss(const ShadingDirection& w, const Roughness& alpha) const;
  // 2 int loss mu dmu, averaged over azimuth.
  double meanLoss(const Roughness& alpha) const;

private:
  LossesAtRoughness lossesAt(const Roughness& alpha) const; // but for the mean
  void fillLosses(const FacetAlbedo& albedo);
  void fillMeans();
  ShadingDirection directionAt(double x, double azimuth, const Roughness& alpha) const;

  Shape shape_;
  Coordinate coordinate_;
  int directions_, azimuths_, ratios_, roughnesses_; // nodes
  std::vector<float> losses_;                        // directions fastest, roughnesses slowest
  int meanRatios_;
  std::vector<double> logMeans_; // ratios fastest
};

// Where lost light goes: rough surfaces lose it everywhere, smooth ones at grazing angles mu ~ alpha. With
// v = mu^2 (even for a Lambert lobe) the density in v is 1 / ((v + alpha^2) ln(1 + 1/alpha^2)).
inline double grazingWidth(const Roughness& alpha) { return alpha.x * alpha.y; } // alpha^2
inline ShadingDirection grazingDirection(const Roughness& alpha, double u, double v) {
  const double a2 = grazingWidth(alpha);
  const double muSquared = std::clamp(a2 * std::expm1(u * std::log1p(1 / a2)), 1e-12, 1.0);
  const double r = std::sqrt(1 - muSquared), phi = 2 * kPi * v;
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(muSquared)};
}
inline double grazingDensity(const ShadingDirection& w, const Roughness& alpha) {
  const double a2 = grazingWidth(alpha);
  return std::abs(w.z()) / (kPi * (squared(w.z()) + a2) * std::log1p(1 / a2));
}

} // namespace surflect::material
