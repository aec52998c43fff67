// Parts of a mesh that lie inside of other parts of it, where solids run into each other: an eye set in a
// head, strands of a braid. They show in no photograph, and surfels on them would take the place of surfels
// on the visible surface beside them.
#pragma once

#include "surfel/geometry/ray_caster.h"

namespace surflect::proxy {

// Returns the mesh without its enclosed triangles, or unchanged if all are enclosed. Vertices are kept. A
// triangle is enclosed if all points slightly in front of it are, sampled at most `pitch` apart (scene units,
// above 0). A point is enclosed if each of six rays from it finds a winding above 0. What lies in a cavity
// with any opening is not enclosed; nor is what an open surface covers from some sides only. Vertices
// connected by unobstructed edges lie in one region of space; eight of them decide for the whole region if
// they agree. Cost: one short ray for each edge, and up to twelve long rays (six for hits, six for winding)
// for each tested point. Throws Cancelled.
TriangleMesh withoutEnclosed(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays, double pitch,
                             const Progress& progress = {});

} // namespace surflect::proxy
