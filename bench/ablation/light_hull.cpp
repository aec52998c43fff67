#include "bench/ablation/light_hull.h"

#include <Eigen/LU>

#include <algorithm>
#include <random>
#include <set>
#include <utility>

namespace surflect::bench {

namespace {

using Triangle = std::array<uint32_t, 3>;

// Six times the volume of the tetrahedron below: above 0 where p lies outside the triangle's plane.
double outside(std::span<const Vec3<double>> points, const Triangle& t, const Vec3<double>& p) {
  const Vec3<double>& a = points[t[0]];
  return (points[t[1]] - a).cross(points[t[2]] - a).dot(p - a);
}

// No two of the points lie in a line with, and no four in a plane: jitter decides.
std::vector<Vec3<double>> inGeneralPosition(std::span<const Vec3<double>> points) {
  constexpr double kJitter = 1e-9;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> offset(-kJitter, kJitter);
  std::vector<Vec3<double>> moved(points.begin(), points.end());
  for (auto& p : moved)
    for (int axis = 0; axis < 3; ++axis) p[axis] += offset(random);
  return moved;
}

// The convex hull, one point after the other: what a new one sees goes, and it is joined to the rim.
std::vector<Triangle> convexHull(std::span<const Vec3<double>> points) {
  if (points.size() < 4) return {};
  std::vector<Triangle> hull{{0, 1, 2}, {0, 2, 1}};
  for (uint32_t p = 3; p < points.size(); ++p) {
    std::set<std::pair<uint32_t, uint32_t>> edges; // of the triangles seen
    std::erase_if(hull, [&](const Triangle& t) {
      if (!(outside(points, t, points[p]) > 0)) return false;
      for (size_t i = 0; i < 3; ++i) edges.insert({t[i], t[(i + 1) % 3]});
      return true;
    });
    for (const auto& [from, to] : edges)
      if (!edges.contains({to, from})) hull.push_back({from, to, p});
  }
  return hull;
}

} // namespace

Vec3<double> barycentricWeights(const std::array<Vec3<double>, 3>& corners, const Vec3<double>& l) {
  Mat3<double> matrix;
  matrix << corners[0], corners[1], corners[2];
  const Vec3<double> b = matrix.inverse() * l;
  return b / b.sum();
}

LightHull::LightHull(std::span<const Direction3<AcquisitionSpace>> lights) {
  for (const auto& light : lights) lights_.push_back(light.raw().cast<double>());
  triangles_ = convexHull(inGeneralPosition(lights_));
}

ulr::BlendSet LightHull::weights(const Direction3<AcquisitionSpace>& towards) const {
  constexpr double kRounding = 1e-6; // on an edge, both triangles have the answer
  const Vec3<double> l = towards.raw().cast<double>();
  ulr::BlendSet blend;
  for (const Triangle& t : triangles_) {
    const std::array corners{lights_[t[0]], lights_[t[1]], lights_[t[2]]};
    const Vec3<double> normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    // A triangle that the origin lies outside of is left by no ray.
    if (!(normal.dot(corners[0]) > 0) || !(normal.dot(l) > 0)) continue;
    const Vec3<double> b = barycentricWeights(corners, l);
    if (!(b.minCoeff() >= -kRounding)) continue;
    for (int i = 0; i < 3; ++i) blend.push({t[static_cast<size_t>(i)], static_cast<float>(b[i])});
    return blend;
  }
  const auto nearest =
      std::ranges::max_element(lights_, {}, [&](const Vec3<double>& light) { return light.dot(l); });
  blend.push({static_cast<uint32_t>(nearest - lights_.begin()), 1});
  return blend;
}

} // namespace surflect::bench
