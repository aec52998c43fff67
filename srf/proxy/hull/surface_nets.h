// Zero surface of a grid's field, as a closed manifold mesh.
#pragma once

#include "srf/proxy/hull/brick_grid.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

namespace surflect::hull {

// Surface net [Gibson 1998]: one vertex in each cell that the surface crosses, at the mean of the crossings
// of the cell's edges; one quad, as two outward triangles, around each crossed edge. Every edge belongs to
// exactly two triangles, and every vertex has a single fan. To ensure that, outside corners are first filled
// where inside corners meet only across the diagonal of a face or of a cell, until none do. The set of inside
// corners is then well-composed [Latecki 1997], and no cell contains two sheets.
TriangleMesh surfaceNet(BrickGrid grid, const Progress& progress);

// Smoothing of a closed mesh.

// Taubin's filter [Taubin 1995, lambda | mu]: pairs of Laplacian steps, one of 0.5 that shrinks and one of
// -0.53 that restores features wider than a few edges. Every vertex must have a neighbour.
TriangleMesh smoothed(TriangleMesh mesh, int pairs, const Progress& progress);

} // namespace surflect::hull
