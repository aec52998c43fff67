// Bounding boxes of points.
#pragma once

#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <vector>

namespace surflect {

// Smallest axis-aligned box; empty without points.
template <class Space> Eigen::AlignedBox3d boundsOf(const std::vector<Point3<Space>>& points) {
  Eigen::AlignedBox3d box;
  for (const auto& p : points) box.extend(p.template cast<double>().raw());
  return box;
}

// Centre of the box of one or more points.
template <class Space> Point3<Space, double> middleOf(const std::vector<Point3<Space>>& points) {
  return assume<Point3<Space, double>>(boundsOf(points).center());
}

} // namespace surflect
