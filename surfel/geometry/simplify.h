// Triangle meshes with fewer triangles, by meshoptimizer's edge collapses.
#pragma once

#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <limits>

namespace surflect {

// Simplifies a mesh to at most `triangles` (>= 1) triangles. More remain where fewer would join parts, close
// them up, or move the surface by more than its extent or about `farthest`, in the mesh's unit. Vertices are
// a subset of the mesh's; vertices at one position count as one. A mesh that is small enough only loses
// unused vertices.
TriangleMesh simplified(const TriangleMesh& mesh, size_t triangles,
                        double farthest = std::numeric_limits<double>::infinity());

} // namespace surflect
