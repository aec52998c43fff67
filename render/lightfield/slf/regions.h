// Texture regions: a mesh cut into connected parts, each homeomorphic to a disc, small and flat.
//
// "Our algorithm proceeds greedily from fine to coarse [...] we would like texture regions to be small and
// flat" [Azuma 1999, §5.2]. At first each triangle is a region. Then the two neighbours whose union costs
// least are joined, again and again, as in face clustering [Garland 2001].
//
// [Azuma 1999] Azuma: Interactive Rendering of Surface Light Fields.
// [Garland 2001] Garland, Willmott, Heckbert: Hierarchical Face Clustering on Polygonal Surfaces.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/angle.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::slf {

struct RegionOptions {
  size_t regions = 200; // wanted; more where the mesh's shape needs them
  // Normals of a region are within such a cone, but for parts with less than 1 % of a region's mean area.
  Angle widestCone = Angle::fromDegrees(80);
};

struct Regions {
  std::vector<uint32_t> ofTriangle; // #triangles; below `count`
  size_t count = 0;

  // Triangles of each region in rising order.
  std::vector<std::vector<uint32_t>> triangles() const;
};

// Partition of a mesh into discs: each region's triangles are connected across edges, and its border is one
// loop that passes no vertex twice. Vertices at one position are one vertex. Edges that have not exactly two
// triangles, or triangles wound differently, are borders. Regions are numbered by their first triangles.
// Throws Error for a mesh without triangles and as triangleGraph() does, and Cancelled.
Regions regionsOf(const TriangleMesh& mesh, const RegionOptions& options = {}, const Progress& progress = {});

} // namespace surflect::slf
