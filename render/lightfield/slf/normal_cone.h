// Cones of normals: an axis and the largest angle from it.
#pragma once

#include "surfel/geometry/mesh.h"
#include "surfel/math/angle.h"
#include "surfel/math/space.h"

#include <cstdint>
#include <span>

namespace surflect::slf {

// All unit vectors within an angle of the axis; none where the axis is 0.
struct NormalCone {
  Vec3<double> axis = Vec3<double>::Zero(); // unit
  Angle halfAngle = Angle::fromRadians(0);

  bool isEmpty() const { return axis.isZero(0); }
};

// Smallest cone that holds two cones.
NormalCone coneAround(const NormalCone& a, const NormalCone& b);

// Cone of the normals of triangles, at most 1 % wider than the smallest one. Triangles without area have no
// normal.
NormalCone normalCone(const TriangleMesh& mesh, std::span<const uint32_t> triangles);

} // namespace surflect::slf
