// Smoothing of regions: triangles at borders change sides, so that regions get rounder, flatter and more even
// and their borders shorter.
#pragma once

#include "render/lightfield/slf/region_moments.h"
#include "render/lightfield/slf/regions.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <span>

namespace surflect::slf {

// Moves triangles one by one while that lowers the sum over regions of E(R) + w l length of border / 2, with
// E and l as in region_moments.h. Regions stay discs and none vanishes. Their normals stay within
// options.widestCone of the axes of the cones that they had.
void smoothRegions(const TriangleMesh& mesh, const TriangleGraph& graph,
                   std::span<const RegionMoments> triangleMoments, const RegionOptions& options,
                   Regions& regions, const Progress& progress = {});

} // namespace surflect::slf
