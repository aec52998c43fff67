// Rectangles of pixels.
#pragma once

namespace surflect::gl {

// Pixels [x, x + width) x [y, y + height); row 0 is the top of the picture.
struct Rect {
  int x = 0, y = 0, width = 0, height = 0;
};

} // namespace surflect::gl
