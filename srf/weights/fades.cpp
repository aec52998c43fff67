#include "srf/weights/fades.h"

#include "srf/weights/ulr.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace surflect::weights {

double smoothStep(double from, double to, double x) {
  assert(from < to);
  const double s = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

double borderFade(const capture::Lens& lens, capture::Pixel pixel) {
  constexpr double kBorder = 6; // pixels
  const double distance = std::min({pixel.x, pixel.y, lens.width - pixel.x, lens.height - pixel.y});
  return smoothStep(0, kBorder, distance);
}

double samplingDensity(const capture::Camera<AcquisitionSpace>& camera,
                       const capture::Viewpoint<AcquisitionSpace>& viewpoint,
                       const Point3<AcquisitionSpace, double>& point) {
  const double unit = viewpoint.isDistant() ? 1 : viewpoint.distance(point);
  return camera.lens.focalX * camera.lens.focalY / (unit * unit);
}

double resolutionFade(double density, double best) {
  if (!(best > 0)) return 1;
  const double share = std::min(1.0, 2 * density / best);
  return share * share;
}

void fadeByResolution(std::span<double> weights, std::span<const double> densities) {
  double best = 0;
  for (size_t view = 0; view < weights.size(); ++view) best = std::max(best, weights[view] * densities[view]);
  for (size_t view = 0; view < weights.size(); ++view) weights[view] *= resolutionFade(densities[view], best);
}

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

} // namespace surflect::weights
