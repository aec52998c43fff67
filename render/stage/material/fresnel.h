// Fresnel reflectance of an interface.
//
// [Born 1999] Born, Wolf: Principles of Optics, 7th ed., §1.5. [Duntley 1942] The optical properties of
// diffusing materials, JOSA 32. [Schlick 1994] An inexpensive BRDF model for physically-based rendering,
// Computer Graphics Forum 13. [Kutz 2021] Kutz, Hasan, Edmondson: Novel aspects of the Adobe Standard
// Material, §3.2 (F82-tint). Symbols: mu cosine to the normal, eta index of refraction behind the interface
// over the one in front of it, F0 reflectance at normal incidence.
#pragma once

#include <algorithm>
#include <cmath>

namespace surflect::material {

// Cosine of the refracted ray by Snell's law; 0 under total reflection.
inline double refractedCosine(double mu, double eta) {
  const double sineSquared = (1 - mu * mu) / (eta * eta);
  return std::sqrt(std::max(0.0, 1 - sineSquared));
}

// Reflectance of unpolarised light at a dielectric, mu >= 0; 1 beyond the critical angle.  [Born 1999,
// §1.5.2]
inline double dielectricFresnel(double mu, double eta) {
  const double muT = refractedCosine(mu, eta);
  if (muT == 0) return 1;
  const double parallel = (eta * mu - muT) / (eta * mu + muT);
  const double perpendicular = (mu - eta * muT) / (mu + eta * muT);
  return (parallel * parallel + perpendicular * perpendicular) / 2;
}

// Mean reflectance over a hemisphere of even radiance, 2 int F mu dmu, for eta > 1.  [Duntley 1942]
inline double denserMeanFresnel(double n) {
  const double n2 = n * n, n4 = n2 * n2;
  return 0.5                                                                                         //
         + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1))                                           //
         + n2 * (n2 - 1) * (n2 - 1) / ((n2 + 1) * (n2 + 1) * (n2 + 1)) * std::log((n - 1) / (n + 1)) //
         - 2 * n2 * n * (n2 + 2 * n - 1) / ((n2 + 1) * (n4 - 1))                                     //
         + 8 * n4 * (n4 + 1) / ((n2 + 1) * (n4 - 1) * (n4 - 1)) * std::log(n);
}

// Mean reflectance for any eta but 1. Equal flux passes both ways: 1 - F(eta) = eta^2 (1 - F(1 / eta)).
inline double meanDielectricFresnel(double eta) {
  return eta > 1 ? denserMeanFresnel(eta) : 1 - eta * eta * (1 - denserMeanFresnel(1 / eta));
}

// Schlick's approximation.  [Schlick 1994, Eq. 15]
inline double schlickFresnel(double mu, double F0) {
  const double m = 1 - mu, m2 = m * m;
  return F0 + (1 - F0) * m2 * m2 * m;
}

// mu (1 - mu)^6, the shape of the dip, greatest at mu = 1/7.
inline double dipShape(double mu) {
  const double m = 1 - mu, m3 = m * m * m;
  return mu * m3 * m3;
}

// Dip below Schlick's curve at 82 degrees, mu = 1/7, by which the tint remains as a factor there.  [Kutz
// 2021]
inline double dipAt82(double F0, double tint) {
  constexpr double mu = 1.0 / 7;
  return schlickFresnel(mu, F0) * (1 - tint) / dipShape(mu);
}

// Reflectance of a conductor by two colours, clamped to 0, below which it would fall just beyond 82 degrees
// for tints near 0.
inline double conductorFresnel(double mu, double F0, double tint) {
  const double m = std::clamp(mu, 0.0, 1.0);
  return std::max(0.0, schlickFresnel(m, F0) - dipAt82(F0, tint) * dipShape(m));
}

// Mean reflectance 2 int F mu dmu: the integrals of mu (1 - mu)^5 and mu^2 (1 - mu)^6 are 1/42 and 1/252.
inline double meanConductorFresnel(double F0, double tint) {
  return F0 + (1 - F0) / 21 - dipAt82(F0, tint) / 126;
}

} // namespace surflect::material
