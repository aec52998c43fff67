// Pictures of few pixels, for tests.
#pragma once

#include "srf/image/image.h"

#include <array>
#include <initializer_list>

namespace surflect::testing {

// A row of RGBA pixels.
inline image::Image colors(std::initializer_list<std::array<float, 4>> pixels) {
  image::Image image(static_cast<int>(pixels.size()), 1, 4);
  size_t i = 0;
  for (const auto& pixel : pixels)
    for (const float value : pixel) image.values[i++] = value;
  return image;
}

} // namespace surflect::testing
