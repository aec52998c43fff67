// Borders in the plane: closed polygons that must not cross themselves.
#pragma once

#include "surfel/math/space.h"

#include <span>

namespace surflect::slf {

// Signed area of a triangle, positive if it is counter-clockwise.
inline double planeArea(const Vec2<double>& p1, const Vec2<double>& p2, const Vec2<double>& p3) {
  const Vec2<double> d = p2 - p1, e = p3 - p1;
  return (d.x() * e.y() - d.y() * e.x()) / 2;
}

// Returns whether the segments ab and cd touch, or come as near as `margin`; also true where rounding leaves
// it open.
bool segmentsMeet(const Vec2<double>& a, const Vec2<double>& b, const Vec2<double>& c, const Vec2<double>& d,
                  double margin = 0);

// Returns whether two edges of a closed polygon touch that are not neighbours.
bool crossesItself(std::span<const Vec2<double>> polygon);

} // namespace surflect::slf
