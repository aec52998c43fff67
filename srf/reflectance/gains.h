// Gains: how much more a surfel reflects than the table of its kind says, in each channel.
//
//   g = (sum_i w_i y_i t_i + b) / (sum_i w_i t_i^2 + b),   w_i = 1 / ((0.1 + t_i) (1 + y_i^2))
//
// Symbols: y_i reflectance in photograph i, t_i = k_i T(x_i) its prediction by the table; both in units of
// the reflectance of a white pixel; b, kGainPrior, strength of the prior that g is 1 (ridge regression [Hoerl
// 1970]). Bright photographs are trusted less: errors of a highlight's shape grow with its brightness.
//
// [Hoerl 1970] Hoerl, Kennard: Ridge Regression, Technometrics 12(1).
#pragma once

#include "srf/reflectance/photographs.h"
#include "surfel/math/rgb.h"

#include <array>
#include <span>
#include <vector>

namespace surflect::reflectance {

// Sums over a surfel's photographs that give its gain.
class GainSums {
public:
  explicit GainSums(float white) : white_(white) {} // reflectance of a white pixel, > 0

  // y_i and t_i, not yet divided by that of a white pixel.
  void add(const Rgb& measured, const Rgb& predicted);

  // g, within kLeastGain and kGreatestGain.
  Rgb gain() const;
  // g without a photograph that was added.
  Rgb gainWithout(const Rgb& measured, const Rgb& predicted) const;

private:
  struct Terms {
    std::array<double, 3> products, squares; // w y t, w t^2
  };
  Terms termsOf(const Rgb& measured, const Rgb& predicted) const;

  float white_;
  std::array<double, 3> products_{}, squares_{};
};
inline constexpr double kGainPrior = 0.1;
inline constexpr float kLeastGain = 0.02f, kGreatestGain = 20;

// Gains of all surfels. predicted: t_i (#photographs). Photographs may be few or none.
std::vector<Rgb> gainsOf(const Photographs& photographs, std::span<const Rgb> predicted, float white);

// Squared difference of logarithms between prediction x and reflectance y, summed over channels; values below
// 0 count as 0:
//   (log(0.03 + x) - log(0.03 + y))^2,   in units of a white pixel
float logError(const Rgb& predicted, const Rgb& measured, float white);

// Mean logError over the photographs of each surfel (#surfels), each predicted with the gain of the others;
// 0 for surfels without photographs. `predicted` as in gainsOf.
std::vector<float> leftOutErrors(const Photographs& photographs, std::span<const Rgb> predicted, float white);

} // namespace surflect::reflectance
