// Geometry that corrects the depth of a lumigraph's rays: all nodes show the same point of this geometry.
#pragma once

#include "surfel/geometry/mesh.h"

#include <cstddef>

namespace surflect::lumigraph {

struct DepthGeometry {
  TriangleMesh mesh;        // the object's own, or a simplified one
  TriangleMesh fringe;      // around a simplified mesh, for pixels that just miss it; or empty
  bool exactOutline = true; // the mesh has the object's outline; if not, texels tell where the object ends
};

// The object's mesh, simplified if it has more than `triangles` triangles; 0: never.
DepthGeometry depthGeometry(const TriangleMesh& object, size_t triangles);

// The simplified mesh with each vertex moved outwards, along its normal, by the mean height of the object's
// vertices above the triangles around it. This covers most of the object. A surface that covered all of it
// would be so far from it that nodes disagreed on the object's outline.
TriangleMesh fringeAround(const TriangleMesh& object, const TriangleMesh& simplified);

} // namespace surflect::lumigraph
