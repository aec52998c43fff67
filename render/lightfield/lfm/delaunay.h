// Delaunay triangulation of points on the disc, called sites.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// Twice the signed area of a triangle; positive if it is counter-clockwise.
inline double doubledArea(const DiscPoint& a, const DiscPoint& b, const DiscPoint& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Least doubledArea() of a triangle that counts as one.
inline constexpr double kLeastArea = 1e-10;

// Triangles, counter-clockwise, each starting at its lowest corner, in rising order: the lower side of the
// convex hull of the sites on a paraboloid, by Qhull. None if the sites are (nearly) collinear. Sites
// (nearly) equal to others, and slivers along the border, may be left out. Sites are finite.
std::vector<std::array<uint32_t, 3>> delaunayTriangles(std::span<const DiscPoint> sites);

} // namespace surflect::lfm
