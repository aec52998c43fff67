// Colours composited over black, as in frames and EXR files.
#pragma once

#include "srf/image/image.h"

#include <cassert>
#include <cstddef>

namespace surflect::image {

// RGBA with colours multiplied by alpha, from straight colours (3 channels) and alpha (1 channel) of one
// size.
inline Image overBlack(const Image& color, const Image& alpha) {
  assert(color.channels == 3 && alpha.channels == 1);
  assert(color.width == alpha.width && color.height == alpha.height);
  Image over(alpha.width, alpha.height, 4);
  for (size_t i = 0; i < alpha.values.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) over.values[4 * i + c] = alpha.values[i] * color.values[3 * i + c];
    over.values[4 * i + 3] = alpha.values[i];
  }
  return over;
}

} // namespace surflect::image
