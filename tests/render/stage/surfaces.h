// Checks of surfaces.
#pragma once

#include "render/stage/surface.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace surflect::stage {

// By the divergence theorem.
inline double volumeOf(const TriangleMesh& mesh) {
  double volume = 0;
  for (size_t i = 0; i < mesh.triangles.size(); ++i)
    volume += areaVector(mesh, i).dot(mesh.positions[mesh.triangles[i][0]].cast<double>().raw()) / 6;
  return volume;
}

inline double areaOf(const TriangleMesh& mesh) {
  double area = 0;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) area += areaVector(mesh, i).norm() / 2;
  return area;
}

// Each edge is passed once each way.
inline bool isClosed(const TriangleMesh& mesh) {
  using Edge = std::pair<std::array<float, 3>, std::array<float, 3>>;
  std::map<Edge, int> balance;
  const auto key = [&](uint32_t i) {
    const auto& p = mesh.positions[i];
    return std::array{p.x(), p.y(), p.z()};
  };
  for (const auto& [a, b, c] : mesh.triangles)
    for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}}) {
      ++balance[{key(from), key(to)}];
      --balance[{key(to), key(from)}];
    }
  return std::ranges::all_of(balance, [](const auto& edge) { return edge.second == 0; });
}

// The largest angle between a triangle and the normals at its corners, in radians.
inline double largestTilt(const Surface& surface) {
  double tilt = 0;
  for (size_t i = 0; i < surface.mesh.triangles.size(); ++i)
    for (const uint32_t vertex : surface.mesh.triangles[i]) {
      const Vec3<double> facet = areaVector(surface.mesh, i).normalized();
      const Vec3<double> normal = surface.normals[vertex].raw().normalized();
      tilt = std::max(tilt, std::atan2(facet.cross(normal).norm(), facet.dot(normal)));
    }
  return tilt;
}

// The largest cosine between a tangent and its normal.
inline double largestLift(const Surface& surface) {
  double lift = 0;
  for (size_t i = 0; i < surface.normals.size(); ++i) {
    const Vec3<double> n = surface.normals[i].raw(), t = surface.tangents[i].raw();
    if (t.norm() > 0) lift = std::max(lift, std::abs(n.dot(t)) / (n.norm() * t.norm()));
  }
  return lift;
}

} // namespace surflect::stage
