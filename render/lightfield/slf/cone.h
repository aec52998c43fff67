// Cones of directions: an axis and the largest angle from it.
#pragma once

#include "surfel/geometry/mesh.h"
#include "surfel/math/angle.h"
#include "surfel/math/space.h"

#include <cstdint>
#include <numbers>
#include <span>

namespace surflect::slf {

// All unit vectors within an angle of the axis; none where the axis is 0.
struct Cone {
  Vec3<double> axis = Vec3<double>::Zero(); // unit
  Angle halfAngle = Angle::fromRadians(0);

  bool isEmpty() const { return axis.isZero(0); }
};

// The cone of all directions.
inline Cone allDirections() { return {Vec3<double>::UnitZ(), Angle::fromRadians(std::numbers::pi)}; }

// In radians; exact also where directions, which need not be unit, are nearly equal or opposite.
double angleBetween(const Vec3<double>& a, const Vec3<double>& b);

// Smallest cone that holds two cones.
Cone coneAround(const Cone& a, const Cone& b);

// Cone of directions, at most 1 % wider than the smallest one. They need not be unit; those of length 0 are
// left out.
Cone coneAround(std::span<const Vec3<double>> directions);

// Cone of the normals of triangles. Triangles without area have no normal.
Cone normalCone(const TriangleMesh& mesh, std::span<const uint32_t> triangles);

} // namespace surflect::slf
