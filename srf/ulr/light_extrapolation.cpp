#include "srf/ulr/light_extrapolation.h"

#include "srf/ulr/ulr.h"
#include "srf/ulr/visibility_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace surflect::ulr {

LightExtrapolationFade::LightExtrapolationFade(std::span<const Direction3<AcquisitionSpace, double>> lights) {
  constexpr double same = 1e-12; // penalty below which two directions coincide
  double largest = 0;
  for (const auto& light : lights) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& other : lights)
      if (const double penalty = anglePenalty(light, other); penalty > same)
        nearest = std::min(nearest, penalty);
    if (std::isfinite(nearest)) largest = std::max(largest, nearest);
  }
  spacing_ = largest > 0 ? 2 * std::asin(std::min(1.0, std::sqrt(largest / 2))) : std::numbers::pi;
  from_ = 1 - std::cos(spacing_);
  to_ = 1 - std::cos(std::min(2 * spacing_, std::numbers::pi));
}

float LightExtrapolationFade::at(float penalty) const {
  return to_ > from_ ? static_cast<float>(1 - smoothStep(from_, to_, penalty)) : 1.f;
}

} // namespace surflect::ulr
