// Where the object must be, from silhouettes alone.
#pragma once

#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/progress.h"

#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace surflect::hull {

// How many of so many votes may be wrong while it is not known which views have bad mattes: a quarter.
inline size_t allowedDissent(size_t votes) { return votes / 4; }

struct Cube {
  Vec3<double> low; // acquisition space
  double edge = 0;

  // Around it.
  Ball ball() const {
    const Vec3<double> center = low.array() + edge / 2;
    return {assume<Point3<AcquisitionSpace, double>>(center), std::sqrt(0.75) * edge};
  }
};

// Of the cubes that fill the box, `across` along its longest side, those in which a point may have a quorum
// and no vote against it, or with `dissent` no more than allowed. By an octree, in its order.
std::vector<Cube> possibleCubes(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                                const Eigen::AlignedBox3d& box, int across, bool dissent,
                                const Progress& progress);

// A cube about pointInView that reaches to the farthest camera, or twice as far as the one in the middle,
// where some stand elsewhere altogether: hulls are cut off there.
Eigen::AlignedBox3d startingBox(std::span<const SilhouetteView> silhouetteViews);

// A box that holds all such points. By carving the starting box again and again, 48 cubes across. Empty where
// there are none.
Eigen::AlignedBox3d boundsOf(std::span<const SilhouetteView> silhouetteViews, size_t quorum, bool dissent,
                             const Progress& progress);

} // namespace surflect::hull
