// Photographs as `surflect render` would have written them.
#pragma once

#include "srf/capture/photograph.h"
#include "srf/image/color.h"

#include <array>

namespace surflect {

// RGBA, premultiplied by alpha, each channel times its weight.
inline Image filmOf(const Photograph& photograph, const Rgb& weight = {1, 1, 1}) {
  Image film(photograph.alpha.width, photograph.alpha.height, 4);
  const std::array weights{weight.r, weight.g, weight.b};
  for (size_t i = 0; i < photograph.alpha.values.size(); ++i) {
    const float alpha = photograph.alpha.values[i];
    for (size_t c = 0; c < 3; ++c)
      film.values[4 * i + c] = alpha * weights[c] * photograph.radiance.values[3 * i + c];
    film.values[4 * i + 3] = alpha;
  }
  return film;
}

} // namespace surflect
