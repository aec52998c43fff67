// Convex hulls of points in space, by Qhull.
#pragma once

#include "surfel/math/space.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lightfield {

// Triangles of the hull, counter-clockwise seen from outside: corners are indices of points. Empty if there
// are fewer than four points, or all lie (nearly) in a plane. Points are finite. Points inside the hull are
// in no triangle, nor need all of several (nearly) equal points be.
std::vector<std::array<uint32_t, 3>> convexHull(std::span<const Vec3<double>> points);

} // namespace surflect::lightfield
