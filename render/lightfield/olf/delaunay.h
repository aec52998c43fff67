// Delaunay triangulation of points of the plane by insertion.
//
// Each point splits the triangle that it is in, and edges flip until no circumcircle holds a point
// [Lawson 1977: Software for C1 Surface Interpolation]. Beyond the hull, triangles have a corner at infinity,
// so that no point is outside of all.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::olf {

struct DelaunayTriangle {
  static constexpr uint32_t kNone = UINT32_MAX;
  std::array<uint32_t, 3> corners;   // counter-clockwise
  std::array<uint32_t, 3> neighbors; // across the edge opposite to each corner; kNone: border
};

// Triangles whose doubledArea() is more than lfm::kLeastArea; none if the sites are (nearly) collinear. Sites
// (nearly) equal to others are left out. Sites are finite. Where rounding spoils the insertion, Qhull
// triangulates. About 0.1 ms for 400 sites.
std::vector<DelaunayTriangle> delaunay(std::span<const lfm::DiscPoint> sites);

} // namespace surflect::olf
