// Energy that single scattering by microfacets loses, tabulated over direction and roughness, and the lobe
// that returns it.
//
// [Kulla 2017] Kulla, Conty: Revisiting physically based shading at Imageworks, SIGGRAPH courses. The lobe
//   loss(wo) loss(wi) / (pi meanLoss)
// reflects the lost energy. It is reciprocal for any error of the table.
#pragma once

#include "render/stage/material/ggx.h"

#include <functional>
#include <vector>

namespace surflect::material {

// Share of light that a facet h, seen from wo above the surface, reflects without being blocked.
using FacetAlbedo =
    std::function<double(const ShadingDirection& wo, const ShadingDirection& h, const Roughness& alpha)>;

// Mean of the albedo over the facets visible from wo, by a fixed rule of 40 x 40 facets; to about 0.001.
double averageOverFacets(const ShadingDirection& wo, const Roughness& alpha, const FacetAlbedo& albedo);

// EnergyCompensation at one roughness.
class LossesAtRoughness {
public:
  double meanLoss = 0; // see EnergyCompensation

  // See EnergyCompensation.
  double loss(const ShadingDirection& w) const;

private:
  friend class EnergyCompensation;
  static constexpr int kMostNodes = 48;

  Roughness stretch_;                  // maps directions to the table's coordinate
  int directions_ = 0, azimuths_ = 0;  // number of nodes; one azimuth means isotropic
  bool turned_ = false;                // azimuth is counted from y
  std::array<float, kMostNodes> rows_; // direction runs fastest
};

// Table shared by all materials that use it; queries are const and thread-safe.
class EnergyCompensation {
public:
  enum class Shape { isotropic, anisotropic };
  // Coordinate in which the loss is smooth: the cosine, if the loss comes from Fresnel's law; the cosine in
  // the space in which the facets form a hemisphere, if it comes from masking.
  enum class Coordinate { plain, stretched };

  // Tabulates 1 - averageOverFacets. Uses all cores; the same bits for any number of them.
  EnergyCompensation(const FacetAlbedo& albedo, Shape shape, Coordinate coordinate);

  // Table at one roughness, for queries in many directions.
  LossesAtRoughness at(const Roughness& alpha) const;

  // Loss of light that leaves towards w, on either side, within 0.004, for roughnesses from bounded().
  // Isotropic tables use alpha.x. A ratio of the two roughnesses below 1/50 counts as 1/50.
  double loss(const ShadingDirection& w, const Roughness& alpha) const;
  // Mean loss 2 int loss mu dmu, averaged over azimuth.
  double meanLoss(const Roughness& alpha) const;

private:
  LossesAtRoughness lossesAt(const Roughness& alpha) const; // without the mean
  void fillLosses(const FacetAlbedo& albedo);
  void fillMeans();
  ShadingDirection directionAt(double x, double azimuth, const Roughness& alpha) const;

  Shape shape_;
  Coordinate coordinate_;
  int directions_, azimuths_, ratios_, roughnesses_; // numbers of nodes
  std::vector<float> losses_;                        // direction runs fastest, roughness slowest
  int meanRatios_;
  std::vector<double> logMeans_; // ratio runs fastest
};

// Distribution of lost light: rough surfaces lose it everywhere, smooth ones at grazing angles mu ~ alpha.
// With v = mu^2 (uniform for a Lambert lobe) the density in v is 1 / ((v + alpha^2) ln(1 + 1/alpha^2)).
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
