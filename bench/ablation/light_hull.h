// Captured lights blended over the triangles that they span on the sphere, instead of by ULR: continuous, and
// with no more than three lights, but bound to a triangulation.
//
// Symbols: l the direction asked for, l_a, l_b, l_c the corners of the triangle that the ray along l leaves
// the convex hull of all lights through; b_a, b_b, b_c its barycentric coordinates there.
#pragma once

#include "srf/ulr/ulr.h"

#include <Eigen/Core>

#include <array>
#include <span>
#include <vector>

namespace surflect::bench {

// Coordinates b with b_a l_a + b_b l_b + b_c l_c along l, and of sum 1: those of the point in which the
// triangle's plane is met. Not finite where l lies in a plane with the triangle.
Vec3<double> barycentricWeights(const std::array<Vec3<double>, 3>& corners, const Vec3<double>& l);

class LightHull {
public:
  // Unit directions, all different. O(n^2). Lights in one plane are told apart by moving them by 1e-9.
  explicit LightHull(std::span<const Direction3<AcquisitionSpace>> lights);

  // Sum to 1. Beyond the hull, where the rig leaves a part of the sphere out, the nearest light alone.
  ulr::BlendSet weights(const Direction3<AcquisitionSpace>& towards) const;

  // Indices of lights, counterclockwise as seen from outside.
  std::span<const std::array<uint32_t, 3>> triangles() const { return triangles_; }

private:
  std::vector<Vec3<double>> lights_;
  std::vector<std::array<uint32_t, 3>> triangles_;
};

} // namespace surflect::bench
