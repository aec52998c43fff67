// The visual hull [Laurentini 1994]: the largest solid with the given silhouettes, as a smooth closed mesh.
// It touches the object along its outlines and closes its concavities.
#pragma once

#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::hull {

struct HullOptions {
  double voxelPixels = 1.5; // edge of a voxel in pixels: the median of what they cover at the object
};

struct VisualHull {
  TriangleMesh mesh;           // closed, manifold, facing outwards
  double voxel = 0;            // scene units
  std::vector<size_t> leftOut; // sights that had no say: empty ones, and see badViews
};

// A point is of the hull if all images that contain it show it inside of the silhouette, and these are a
// quorum. The grid has at most 512 voxels a side. Throws Error, which names the views at fault, where the
// silhouettes have no common point or all look along one line; Cancelled.
VisualHull visualHull(std::span<const SilhouetteView> silhouetteViews, const HullOptions& options,
                      const Progress& progress);

} // namespace surflect::hull
