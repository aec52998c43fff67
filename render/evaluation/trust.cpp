#include "render/evaluation/trust.h"

#include <cassert>

namespace surflect::evaluation {

Trust trustIn(const image::Image& color, const image::Image& predictedError, double white) {
  assert(color.channels == 4 && predictedError.channels == 1 &&
         color.values.size() == 4 * predictedError.values.size());
  Trust trust;
  for (size_t pixel = 0; pixel < predictedError.values.size(); ++pixel) {
    if (!(color.values[4 * pixel + 3] > 0.5f)) continue;
    ++trust.pixels;
    if (predictedError.values[pixel] <= kTrustedError * white) ++trust.trusted;
  }
  return trust;
}

} // namespace surflect::evaluation
