// Reference frame of a vertex, and the disc of viewing directions in it.
//
// [Chen 2002, §3, Eq. 7] Chen et al.: Light Field Mapping, SIGGRAPH.
// Symbols: d the unit direction from the surface towards the viewer; x, y, z the axes of the frame.
#pragma once

#include "surfel/math/space.h"

namespace surflect::lfm {

using Direction = Direction3<AcquisitionSpace, double>;

// Position in the square [0, 1]^2 whose inscribed disc holds the hemisphere of directions.
using DiscPoint = Vec2<double>;

// Orthonormal and right-handed, in acquisition space.
struct VertexFrame {
  Vec3<double> x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
};

// Frame whose z axis is along a normal, which must not be 0.
VertexFrame frameAlong(const Vec3<double>& normal);

// ((d.x + 1) / 2, (d.y + 1) / 2)  [Chen 2002, Eq. 7]. A direction below the horizon has the point of the rim
// at its azimuth.
DiscPoint discPoint(const VertexFrame& frame, const Direction& d);

// Direction on the upper hemisphere at a point of the disc. A point outside has the horizon's direction at
// its azimuth.
Direction directionAt(const VertexFrame& frame, const DiscPoint& point);

} // namespace surflect::lfm
