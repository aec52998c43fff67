// Grid meshes, from which the shapes of the light stage are made.
#pragma once

#include "render/stage/surface.h"

#include <functional>

namespace surflect::stage {

struct SurfacePoint {
  Vec3<double> position, normal, tangent;
  Vec2<double> st; // texture coordinates
};

// Appends a grid of columns x rows squares over (s, t) in [0,1]^2, without triangles that have no area. Seen
// from outside, t points to the left of s. Throws Error if the surface would have more than kMostTriangles.
void addGridMesh(Surface& surface, int columns, int rows,
                 const std::function<SurfacePoint(double s, double t)>& point);

} // namespace surflect::stage
