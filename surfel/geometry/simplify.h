// Triangle meshes with fewer triangles, by meshoptimizer's edge collapses.
#pragma once

#include "surfel/geometry/mesh.h"

#include <cstddef>

namespace surflect {

// Simplifies a mesh to at most `triangles` (>= 1) triangles. More remain where fewer would join parts, close
// them up, or move the surface by more than its extent. Vertices are a subset of the mesh's;
// vertices at one position count as one. A mesh that is small enough only loses unused vertices.
TriangleMesh simplified(const TriangleMesh& mesh, size_t triangles);

} // namespace surflect
