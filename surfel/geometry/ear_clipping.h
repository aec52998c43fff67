// Triangulation of polygons that may be concave.
//
// [Meisters 1975] Meisters: Polygons Have Ears, American Mathematical Monthly 82(6). [Sutherland 1974]
// Sutherland, Sproull, Schumacker: A Characterization of Ten Hidden-Surface Algorithms, ACM Computing Surveys
// 6(1): Newell's normal, twice the area vector of a closed polygon.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/math/space.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

// Sum of the cross products of successive corners: twice the area vector of a planar or non-planar polygon.
Vec3<double> newellNormal(std::span<const Vec3<double>> corners);

// Appends corners.size() - 2 triangles, as indices into `corners` (three or more), wound like the polygon.
// Uses the fan around the first corner if it covers the polygon, as for every convex one; otherwise clips
// ears in the projection along the axis nearest to Newell's normal. Corners may repeat, as at a seam that
// joins a hole to the outline, and may be collinear: these corners get triangles without area. A
// self-intersecting polygon gets the same number of triangles, some of which overlap. Cost: O(n) for fans;
// O(n) per corner of a concave polygon at worst. Throws Cancelled.
void appendTriangles(std::span<const Vec3<double>> corners, std::vector<std::array<uint32_t, 3>>& triangles,
                     const Progress& progress = {});

} // namespace surflect
