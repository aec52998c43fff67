// Cropping and resizing of pictures.
#pragma once

#include "srf/image/image.h"

namespace surflect::image {

// Pixels [x0, x1) x [y0, y1).
struct PixelWindow {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
};

// Window of the image at width x height pixels, each the mean over its area, so that sums of light are kept.
// The window lies in the image. Enlarging repeats pixels.
Image resampled(const Image& image, const PixelWindow& window, int width, int height);

// Means of squares of side x side pixels, from pixel (0, 0); exact for a square of equal pixels whose sums
// floats can represent. The picture is cut to whole squares.
Image squareMeans(const Image& image, int side);
// Minimum of each channel over the same squares.
Image squareMinima(const Image& image, int side);

} // namespace surflect::image
