#include "render/control/relative_error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::control {

double relativeRms(const image::Image& a, const image::Image& b) {
  assert(a.width == b.width && a.height == b.height && a.channels == b.channels && a.channels >= 3);
  const auto channels = static_cast<size_t>(a.channels);
  double difference = 0, energy = 0; // summed in one order, so that the bits do not depend on threads
  for (size_t i = 0; i < a.values.size(); i += channels)
    for (size_t c = i; c < i + 3; ++c) {
      const double d = double{a.values[c]} - double{b.values[c]};
      difference += d * d;
      energy += double{b.values[c]} * double{b.values[c]};
    }
  if (difference == 0) return 0;
  return energy > 0 ? std::sqrt(difference / energy) : std::numeric_limits<double>::infinity();
}

} // namespace surflect::control
