// Triangles of a polygon that need not be convex.
//
// [Meisters 1975] Meisters: Polygons Have Ears, American Mathematical Monthly 82(6).
// [Sutherland 1974] Sutherland, Sproull, Schumacker: A Characterization of Ten Hidden-Surface Algorithms, ACM
// Computing Surveys 6(1): Newell's normal, twice the area vector of a closed polygon.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/math/space.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

// Sum of the cross products of successive corners: twice the area vector, of a polygon planar or not.
Vec3<double> newellNormal(std::span<const Vec3<double>> corners);

// Appends corners.size() - 2 triangles, as indices into `corners` (three or more), wound as the polygon is.
// The fan around the first corner where it covers the polygon, as it does of every convex one; ears else,
// clipped in the projection along the axis nearest to Newell's normal. Corners may repeat, as where a hole is
// joined to the outline by a seam, and lie on a line: triangles without area take up such corners. A polygon
// that crosses itself gets as many triangles, some of which overlap. Cost: O(n) for fans; O(n) per corner of
// a concave polygon at worst. Throws Cancelled.
void appendTriangles(std::span<const Vec3<double>> corners, std::vector<std::array<uint32_t, 3>>& triangles,
                     const Progress& progress = {});

} // namespace surflect
