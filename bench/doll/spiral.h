// Directions spread evenly over a zone of the sphere: a Fibonacci spiral.
#pragma once

#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace surflect::bench {

// `count` unit vectors on a spiral around z between two heights, -1..1, each with an equal share of the
// zone's area; azimuths advance by the golden section of a turn.  [Swinbank and Purser 2006] Fibonacci grids,
// QJRMS 132.
inline std::vector<Vec3<double>> spiral(size_t count, double lowest = -1, double highest = 1) {
  constexpr double kGoldenTurn = std::numbers::pi * 2 / (std::numbers::phi * std::numbers::phi);
  std::vector<Vec3<double>> directions;
  for (size_t i = 0; i < count; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double z = lowest + (highest - lowest) * share, radius = std::sqrt(std::max(0.0, 1 - z * z));
    const double azimuth = kGoldenTurn * static_cast<double>(i);
    directions.emplace_back(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
  }
  return directions;
}

} // namespace surflect::bench
