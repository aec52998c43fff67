// Smoothing of a closed mesh.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

namespace surflect::hull {

// Taubin's filter [Taubin 1995, lambda | mu]: pairs of Laplacian steps, one of 0.5 that shrinks and one of
// -0.53 that restores features wider than a few edges. Every vertex must have a neighbour.
TriangleMesh smoothed(TriangleMesh mesh, int pairs, const Progress& progress);

} // namespace surflect::hull
