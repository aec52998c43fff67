// Evenly spread directions.
#pragma once

#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace surflect {

// `count` unit vectors on a Fibonacci spiral around z, between two heights of the unit sphere (-1..1). Each
// has an equal share of the zone's area. Azimuths, from +x towards +y, begin at `start` and advance by the
// golden angle.  [Swinbank and Purser 2006] Fibonacci grids: a novel approach to global modelling, QJRMS 132.
inline std::vector<Vec3<double>> fibonacciSphere(size_t count, double lowest = -1, double highest = 1,
                                                 Angle start = {}) {
  const double goldenAngle = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Vec3<double>> directions;
  for (size_t i = 0; i < count; ++i) {
    const auto k = static_cast<double>(i);
    const double z = lowest + (highest - lowest) * (k + 0.5) / static_cast<double>(count);
    const double radius = std::sqrt(std::max(0.0, 1 - z * z));
    const double azimuth = start.radians() + goldenAngle * k;
    directions.emplace_back(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
  }
  return directions;
}

} // namespace surflect
