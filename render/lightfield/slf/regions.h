// Texture regions: a mesh cut into connected parts, each homeomorphic to a disc, small and flat.
//
// "Our algorithm proceeds greedily from fine to coarse [...] we would like texture regions to be small and
// flat" [Azuma 1999, §5.2]. At first each triangle is a region. Then the two neighbours whose union costs
// least are joined, again and again, as in face clustering [Garland 2001].
//
// The energy of a region R is its spread in space and in normals,
//   E(R) = integral over R of |x - mean x|^2 / l^2 + |n - mean n|^2,
// where the second term is the distance of [Cohen-Steiner 2004] and l is the side of a square of the mean
// region's area. Small, round and flat regions of even sizes have the least sum of energies.
//
// [Azuma 1999] Azuma: Interactive Rendering of Surface Light Fields.
// [Garland 2001] Garland, Willmott, Heckbert: Hierarchical Face Clustering on Polygonal Surfaces.
// [Ward 1963] Ward: Hierarchical Grouping to Optimize an Objective Function.
// [Cohen-Steiner 2004] Cohen-Steiner, Alliez, Desbrun: Variational Shape Approximation, §3.
#pragma once

#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::slf {

// Size, place and flatness of a part of a mesh, as sums over its surface.
struct RegionMoments {
  double area = 0;
  Vec3<double> point = Vec3<double>::Zero();  // integral of x
  Vec3<double> normal = Vec3<double>::Zero(); // integral of n

  friend RegionMoments operator+(const RegionMoments& a, const RegionMoments& b) {
    return {a.area + b.area, a.point + b.point, a.normal + b.normal};
  }
};

// E(A and B) - E(A) - E(B), at least 0 [Ward 1963]; 0 if a part has no area. squaredLength is l^2.
inline double unionCost(const RegionMoments& a, const RegionMoments& b, double squaredLength) {
  if (!(a.area > 0 && b.area > 0)) return 0;
  return a.area * b.area / (a.area + b.area) *
         ((a.point / a.area - b.point / b.area).squaredNorm() / squaredLength +
          (a.normal / a.area - b.normal / b.area).squaredNorm());
}

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
