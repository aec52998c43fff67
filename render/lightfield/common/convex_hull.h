// Convex hulls of points in space, by Qhull.
#pragma once

#include "surfel/math/space.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lightfield {

// Triangles of the hull, counter-clockwise seen from outside: corners are indices of points. Empty if there
// are fewer than four points, or all lie (nearly) in a plane. Points are finite; points inside the hull, and
// some of several (nearly) equal ones, are in no triangle.
std::vector<std::array<uint32_t, 3>> convexHull(std::span<const Vec3<double>> points);

} // namespace surflect::lightfield
