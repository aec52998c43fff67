// Short texts on images, in a bitmap font of 5 x 8 pixels.
#pragma once

#include "srf/image/image.h"
#include "surfel/math/rgb.h"

#include <string_view>

namespace surflect::evaluation {

// Size of a character at scale 1, including the space to its neighbours.
inline constexpr int kLabelAdvance = 6, kLabelHeight = 8; // pixels

// Draws text with its upper left corner at (x, y), magnified by `scale`; parts outside the image are clipped.
// Characters other than printable ASCII become a box. The image has three channels in the encoding of
// `color`. Returns the x at which further text would begin.
int drawLabel(image::Image& image, int x, int y, std::string_view text, Rgb color, int scale);

} // namespace surflect::evaluation
