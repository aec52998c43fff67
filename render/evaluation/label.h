// Short texts on pictures, in a font of 5 x 8 pixels.
#pragma once

#include "srf/image/image.h"
#include "surfel/math/rgb.h"

#include <string_view>

namespace surflect::evaluation {

// What a character takes at scale 1, the space to its neighbours included.
inline constexpr int kLabelAdvance = 6, kLabelHeight = 8; // pixels

// Draws the text with its upper left corner at (x, y), `scale` pixels for one; parts off the image are left
// out. What is not printable ASCII becomes a box. The image has three channels, of the same encoding as
// `color`. Returns the x where a text that goes on would begin.
int drawLabel(image::Image& image, int x, int y, std::string_view text, Rgb color, int scale);

} // namespace surflect::evaluation
