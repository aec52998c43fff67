// Colours that distinguish cameras and lights in pictures of their blends.  [Weyrich 2005, Fig. 16]
#pragma once

#include "surfel/math/rgb.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace surflect::shading {

// A saturated colour for each index, independent of `count`. Hue advances by sqrt(2) turns: steps of the
// golden section would give neighbours on a Fibonacci spiral, a common layout of rigs, the same colour.
inline std::vector<Rgb> blendColors(size_t count) {
  const auto channel = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
  std::vector<Rgb> colors;
  for (size_t i = 0; i < count; ++i) {
    const double turns = static_cast<double>(i) * 0.41421356237309515;
    const double hue = 6 * (turns - std::floor(turns));
    colors.push_back(
        {channel(std::abs(hue - 3) - 1), channel(2 - std::abs(hue - 2)), channel(2 - std::abs(hue - 4))});
  }
  return colors;
}

} // namespace surflect::shading
