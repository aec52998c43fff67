// Bounds of the object from silhouettes alone.
#pragma once

#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/time.h"

#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace surflect::hull {

// Number of votes that may be wrong while bad mattes are not yet known: a quarter.
inline size_t allowedDissent(size_t votes) { return votes / 4; }

struct Cube {
  Vec3<double> low; // acquisition space
  double edge = 0;

  // Bounding ball.
  Ball ball() const {
    const Vec3<double> center = low.array() + edge / 2;
    return {assume<Point3<AcquisitionSpace, double>>(center), std::sqrt(0.75) * edge};
  }
};

// Cubes in which some point may have a quorum and no vote against it, or with `dissent` at most
// allowedDissent() votes against it. Their edge is the box's longest side over `across`. They are in the
// order of an octree.
std::vector<Cube> possibleCubes(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                                const Eigen::AlignedBox3d& box, int across, bool dissent,
                                const Progress& progress);

// A cube about pointInView that reaches to the farthest camera, or twice as far as the median camera if some
// are far away: hulls are clipped there.
Eigen::AlignedBox3d startingBox(std::span<const SilhouetteView> silhouetteViews);

// Box of all points that possibleCubes() accepts, by carving the starting box repeatedly, 48 cubes across.
// Empty if there are none.
Eigen::AlignedBox3d boundsOf(std::span<const SilhouetteView> silhouetteViews, size_t quorum, bool dissent,
                             const Progress& progress);

} // namespace surflect::hull
