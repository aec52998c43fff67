#include "render/lightfield/lfm/delaunay.h"

#include "render/lightfield/common/convex_hull.h"
#include "surfel/math/space.h"

#include <algorithm>

namespace surflect::lfm {

std::vector<std::array<uint32_t, 3>> delaunayTriangles(std::span<const DiscPoint> sites) {
  DiscPoint middle = DiscPoint::Zero();
  for (const DiscPoint& p : sites) middle += p / static_cast<double>(sites.size());
  std::vector<Vec3<double>> lifted;
  for (const DiscPoint& p : sites) lifted.emplace_back(p[0], p[1], (p - middle).squaredNorm());
  // A point far above makes the hull solid even if all sites are on one circle.
  lifted.emplace_back(middle[0], middle[1], 4.0);
  const auto above = static_cast<uint32_t>(sites.size());
  std::vector<std::array<uint32_t, 3>> triangles;
  for (const auto& [a, b, c] : lightfield::convexHull(lifted)) {
    if (a == above || b == above || c == above) continue;
    std::array<uint32_t, 3> corners{a, c, b}; // as seen from above
    if (!(doubledArea(sites[a], sites[c], sites[b]) > kLeastArea)) continue;
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    triangles.push_back(corners);
  }
  std::ranges::sort(triangles);
  return triangles;
}

} // namespace surflect::lfm
