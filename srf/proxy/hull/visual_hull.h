// Visual hull [Laurentini 1994]: the largest solid with the given silhouettes, as a smooth closed mesh. It
// touches the object along its outlines and closes concavities.
#pragma once

#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::hull {

struct HullOptions {
  double voxelPixels = 1.5; // edge of a voxel in pixels, by the median footprint at the object
};

struct VisualHull {
  TriangleMesh mesh;           // closed, manifold, facing outwards
  double voxel = 0;            // scene units
  std::vector<size_t> leftOut; // ignored silhouettes: empty ones, and those of badViews
};

// A point belongs to the hull if all images that contain it show it inside the silhouette, and these are a
// quorum. The grid has at most 512 voxels per side. Throws Error naming the views at fault if the silhouettes
// have no common point or all look along one line; Cancelled.
VisualHull visualHull(std::span<const SilhouetteView> silhouetteViews, const HullOptions& options,
                      const Progress& progress);

} // namespace surflect::hull
