// Size, place and flatness of a part of a mesh, as sums over its surface.
//
// The energy of a region R is its spread in space and in normals,
//   E(R) = integral over R of |x - mean x|^2 / l^2 + |n - mean n|^2,
// where the second term is the distance of [Cohen-Steiner 2004] and l is the side of a square of the mean
// region's area. Small, round and flat regions of even sizes have the least sum of energies.
//
// [Ward 1963] Ward: Hierarchical Grouping to Optimize an Objective Function.
// [Cohen-Steiner 2004] Cohen-Steiner, Alliez, Desbrun: Variational Shape Approximation, §3.
#pragma once

#include "surfel/math/space.h"

namespace surflect::slf {

struct RegionMoments {
  double area = 0;
  Vec3<double> point = Vec3<double>::Zero();  // integral of x
  Vec3<double> normal = Vec3<double>::Zero(); // integral of n

  friend RegionMoments operator+(const RegionMoments& a, const RegionMoments& b) {
    return {a.area + b.area, a.point + b.point, a.normal + b.normal};
  }
  friend RegionMoments operator-(const RegionMoments& a, const RegionMoments& b) {
    return {a.area - b.area, a.point - b.point, a.normal - b.normal};
  }
};

// E(A and B) - E(A) - E(B), at least 0 [Ward 1963]; 0 if a part has no area. squaredLength is l^2.
inline double unionCost(const RegionMoments& a, const RegionMoments& b, double squaredLength) {
  if (!(a.area > 0 && b.area > 0)) return 0;
  return a.area * b.area / (a.area + b.area) *
         ((a.point / a.area - b.point / b.area).squaredNorm() / squaredLength +
          (a.normal / a.area - b.normal / b.area).squaredNorm());
}

} // namespace surflect::slf
