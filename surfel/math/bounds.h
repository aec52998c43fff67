// How far points reach.
#pragma once

#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <vector>

namespace surflect {

// The smallest box with sides along the axes; empty where there is no point.
template <class Space> Eigen::AlignedBox3d boundsOf(const std::vector<Point3<Space>>& points) {
  Eigen::AlignedBox3d box;
  for (const auto& p : points) box.extend(p.template cast<double>().raw());
  return box;
}

// Its centre; of one point or more.
template <class Space> Point3<Space, double> middleOf(const std::vector<Point3<Space>>& points) {
  return assume<Point3<Space, double>>(boundsOf(points).center());
}

} // namespace surflect
