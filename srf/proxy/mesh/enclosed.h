// Parts of a mesh that lie inside of other parts of it, where solids run into each other: an eye set in a
// head, strands of a braid. They show on no photograph, and would take the surfels' places next to them.
#pragma once

#include "surfel/geometry/ray_caster.h"

namespace surflect::proxy {

// The mesh without triangles that are enclosed: a little in front of each of their points, tried `pitch`
// apart at most (scene units, above 0), each of six rays finds a winding above 0. Vertices between which the
// way along an edge is free lie in one region of space, for which eight of them tell where they agree.
// Vertices stay as they are. What lies in a cavity with any opening is not enclosed; nor is what an open
// surface only covers from some sides. All triangles where none would be left. Cost: one short ray for each
// edge; up to twelve long ones (six for hits, six for winding) for each point asked. Throws Cancelled.
TriangleMesh withoutEnclosed(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays, double pitch,
                             const Progress& progress = {});

} // namespace surflect::proxy
