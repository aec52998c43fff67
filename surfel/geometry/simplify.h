// Triangle meshes with fewer triangles, by meshoptimizer's edge collapses.
#pragma once

#include "surfel/geometry/mesh.h"

#include <cstddef>

namespace surflect {

// Approximates a mesh by at most `triangles` triangles, at least one, where its topology allows that: parts
// are not joined, and neither parts nor holes vanish, so there may be more. Its vertices are some of the
// mesh's. Parts at one position count as joined. A mesh that is no larger is returned without unused
// positions.
TriangleMesh simplified(const TriangleMesh& mesh, size_t triangles);

} // namespace surflect
