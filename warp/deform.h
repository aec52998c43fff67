// Applies a warp to a surfel cloud or to a mesh; tangents by its Jacobian, or by central differences
// [Weyrich 2005, Eq. 6] (warp.h).
#pragma once

#include "surfel/base/time.h"
#include "surfel/cloud.h"
#include "surfel/geometry/mesh.h"
#include "warp/warp.h"

namespace surflect::warp {

// p = Psi(p0), u = J u0, v = J v0, and the handedness: mirrored if det J < 0; dead if polarFrame finds no
// frame for (u, v) or a value is not finite in float. p, u, v of dead surfels are 0. J is the warp's own, or
// by Eq. 6 along u0, v0, n0 with differenceStep(). Evaluated in double, in the caller's arena; the same bits
// for any number of threads, and for AVX2 and AVX-512. `kept`, a cloud that is no longer needed, donates its
// memory.
DeformedCloud deform(const SurfelCloud& cloud, const Warp& warp, const Progress& progress = {},
                     DeformedCloud kept = {});

// deform, over the result of an earlier call. Returns false if every bit is as it was. What Cancelled leaves
// in `deformed` has no meaning.
bool deformInto(const SurfelCloud& cloud, const Warp& warp, const Progress& progress,
                DeformedCloud& deformed);

// Mesh with deformed vertices. The mesh must be fine enough for the warp.
Mesh<ObjectSpace> deform(const TriangleMesh& mesh, const Warp& warp);

// Step of the central differences for a cloud. With M the largest coordinate, rounding of Psi costs e M /
// epsilon (e = 2^-53), and truncation about epsilon^2 / (6 l^2) for a warp with features of size l. The sum
// is least at epsilon = (3 e M l^2)^(1/3). l is assumed to be 1/16 of the bounding box's diagonal, M/16 for a
// cloud without extent, and 1/16 for one at the origin.
double differenceStep(const SurfelCloud& cloud);

} // namespace surflect::warp
