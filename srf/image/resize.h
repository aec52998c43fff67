// Parts of pictures, and pictures of another size.
#pragma once

#include "srf/image/image.h"

namespace surflect::image {

// Pixels [x0, x1) x [y0, y1).
struct PixelWindow {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
};

// The window, which lies in the image, in width x height pixels, each the mean of the area that it covers.
// Keeps sums of light; a larger picture shows the image's pixels as they are.
Image resampled(const Image& image, const PixelWindow& window, int width, int height);

} // namespace surflect::image
