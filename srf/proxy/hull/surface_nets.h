// The surface on which a grid's field is zero, as a closed manifold mesh.
#pragma once

#include "srf/proxy/hull/brick_grid.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

namespace surflect::hull {

// A surface net [Gibson 1998]: one vertex in each cell that the surface crosses, at the mean of the crossings
// of the cell's edges; one quad, as two triangles that face outwards, around each edge that is crossed. Every
// edge of the mesh belongs to exactly two triangles and every vertex has one fan of them: first, where inside
// corners meet only across the diagonal of a face or of a cell, outside corners between them are filled until
// none do (the set of inside corners is then well-composed [Latecki 1997], and in no cell two sheets meet).
TriangleMesh surfaceNet(BrickGrid grid, const Progress& progress);

} // namespace surflect::hull
