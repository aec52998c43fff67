// Fairing of a closed mesh.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

namespace surflect::hull {

// Taubin's filter [Taubin 1995, lambda | mu]: steps of Laplacian smoothing in pairs, one of 0.5 that shrinks
// and one of -0.53 that undoes the shrinking of all that is wider than a few edges. Every vertex must have a
// neighbour.
TriangleMesh smoothed(TriangleMesh mesh, int pairs, const Progress& progress);

} // namespace surflect::hull
