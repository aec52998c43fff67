#include "render/lightfield/lfm/delaunay.h"

#include "render/lightfield/common/convex_hull.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace surflect::lfm {

namespace {

using Triangle = std::array<uint32_t, 3>;

// Corner at infinity: (u, v, kFar) is the half plane to the left of a border edge, which runs clockwise.
constexpr uint32_t kFar = UINT32_MAX;

// Positive if p is inside the circle through a counter-clockwise triangle.
double inCircle(const DiscPoint& a, const DiscPoint& b, const DiscPoint& c, const DiscPoint& p) {
  const DiscPoint u = a - p, v = b - p, w = c - p;
  return u.squaredNorm() * (v[0] * w[1] - v[1] * w[0]) + v.squaredNorm() * (w[0] * u[1] - w[1] * u[0]) +
         w.squaredNorm() * (u[0] * v[1] - u[1] * v[0]);
}

bool conflicts(const Triangle& corners, std::span<const DiscPoint> sites, const DiscPoint& p) {
  const DiscPoint &a = sites[corners[0]], &b = sites[corners[1]];
  if (corners[2] != kFar) return inCircle(a, b, sites[corners[2]], p) > 0;
  const double side = doubledArea(a, b, p);
  return side > 0 || (side == 0 && (a - p).dot(b - p) < 0);
}

// Largest x of the circle through a counter-clockwise triangle, and a little more; infinite for a half plane.
double rightOfCircle(const Triangle& corners, std::span<const DiscPoint> sites) {
  constexpr double kMargin = 1e-6;
  if (corners[2] == kFar) return std::numeric_limits<double>::infinity();
  const DiscPoint& a = sites[corners[0]];
  const DiscPoint b = sites[corners[1]] - a, c = sites[corners[2]] - a;
  const double area = doubledArea({0, 0}, b, c);
  if (!(area > kLeastArea)) return std::numeric_limits<double>::infinity();
  const DiscPoint center = DiscPoint(c[1] * b.squaredNorm() - b[1] * c.squaredNorm(),
                                     b[0] * c.squaredNorm() - c[0] * b.squaredNorm()) /
                           (2 * area);
  return a[0] + center[0] + (1 + kMargin) * center.norm() + kMargin;
}

// Triangulation of the sites that have been inserted.
class Insertion {
public:
  // Begins with one counter-clockwise triangle.
  Insertion(std::span<const DiscPoint> sites, const Triangle& first) : sites_(sites) {
    const auto& [a, b, c] = first;
    for (const Triangle& corners : {first, {b, a, kFar}, {c, b, kFar}, {a, c, kFar}}) add(corners);
  }

  // Replaces the triangles whose circles hold a site by a fan around it. Sites come in rising order of x.
  // Returns false if rounding has spoiled the triangulation: each site adds two triangles, half planes
  // included. Triangles that overlap would double from site to site.
  bool insert(uint32_t site) {
    const size_t before = finished_.size() + open_.size();
    const DiscPoint& p = sites_[site];
    std::vector<std::array<uint32_t, 2>> edges; // of the triangles that are removed, as they run
    std::erase_if(open_, [&](const Open& triangle) {
      const Triangle& corners = triangle.corners;
      if (triangle.right < p[0]) {
        finished_.push_back(corners);
        return true;
      }
      if (!conflicts(corners, sites_, p)) return false;
      for (size_t k = 0; k < 3; ++k) edges.push_back({corners[k], corners[(k + 1) % 3]});
      return true;
    });
    // An edge between two of them comes once in each direction: it is inside the fan.
    std::ranges::sort(edges, {}, [](const auto& edge) { return std::minmax(edge[0], edge[1]); });
    const auto isTurned = [](const auto& edge, const auto& next) {
      return edge[0] == next[1] && edge[1] == next[0];
    };
    for (size_t i = 0; i < edges.size(); ++i) {
      if (i + 1 < edges.size() && isTurned(edges[i], edges[i + 1])) {
        ++i;
        continue;
      }
      const auto [from, to] = edges[i];
      if (from == kFar)
        add({to, site, kFar});
      else if (to == kFar)
        add({site, from, kFar});
      else
        add({from, to, site});
    }
    return finished_.size() + open_.size() == before + 2;
  }

  std::vector<Triangle> triangles() const {
    std::vector<Triangle> all = finished_;
    for (const Open& triangle : open_)
      if (triangle.corners[2] != kFar) all.push_back(triangle.corners);
    return all;
  }

private:
  struct Open {
    Triangle corners;
    double right; // of the circle; sites beyond do not change the triangle
  };
  void add(const Triangle& corners) { open_.push_back({corners, rightOfCircle(corners, sites_)}); }

  std::span<const DiscPoint> sites_;
  std::vector<Open> open_;
  std::vector<Triangle> finished_;
};

// Sites in rising order of x, without those that are nearly equal to another.
std::vector<uint32_t> distinctSites(std::span<const DiscPoint> sites) {
  constexpr double kDistinct = 1e-7;
  std::vector<uint32_t> order(sites.size()), distinct;
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, {}, [&](uint32_t i) { return sites[i][0]; });
  for (const uint32_t i : order) {
    const auto near = std::ranges::find_if(distinct.rbegin(), distinct.rend(), [&](uint32_t j) {
      return sites[i][0] - sites[j][0] > kDistinct || (sites[i] - sites[j]).norm() < kDistinct;
    });
    if (near == distinct.rend() || sites[i][0] - sites[*near][0] > kDistinct) distinct.push_back(i);
  }
  return distinct;
}

// Triangles by insertion; empty if rounding has spoiled them or turned one over.
std::optional<std::vector<Triangle>> byInsertion(std::span<const DiscPoint> sites) {
  std::vector<uint32_t> order = distinctSites(sites);
  if (order.size() < 3) return std::vector<Triangle>();
  const auto areaWith = [&](uint32_t i) { return doubledArea(sites[order[0]], sites[order[1]], sites[i]); };
  const auto third = std::ranges::find_if(order.begin() + 2, order.end(),
                                          [&](uint32_t i) { return std::abs(areaWith(i)) > kLeastArea; });
  if (third == order.end()) return std::vector<Triangle>();
  // The sites before the third are on the line of the first two, and touch no circle that is finished.
  std::rotate(order.begin() + 2, third, third + 1);
  if (areaWith(order[2]) < 0) std::swap(order[0], order[1]);
  Insertion insertion(sites, {order[0], order[1], order[2]});
  for (size_t i = 3; i < order.size(); ++i)
    if (!insertion.insert(order[i])) return std::nullopt;
  std::vector<Triangle> triangles = insertion.triangles();
  if (std::ranges::any_of(triangles, [&](const Triangle& corners) {
        return doubledArea(sites[corners[0]], sites[corners[1]], sites[corners[2]]) < -kLeastArea;
      }))
    return std::nullopt;
  return triangles;
}

// Triangles with an area, in a fixed order.
std::vector<Triangle> tidied(std::vector<Triangle> triangles, std::span<const DiscPoint> sites) {
  std::erase_if(triangles, [&](const Triangle& corners) {
    return !(doubledArea(sites[corners[0]], sites[corners[1]], sites[corners[2]]) > kLeastArea);
  });
  for (Triangle& corners : triangles)
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
  std::ranges::sort(triangles);
  return triangles;
}

} // namespace

std::vector<Triangle> delaunayByHull(std::span<const DiscPoint> sites) {
  DiscPoint middle = DiscPoint::Zero();
  for (const DiscPoint& p : sites) middle += p / static_cast<double>(sites.size());
  std::vector<Vec3<double>> lifted;
  for (const DiscPoint& p : sites) lifted.emplace_back(p[0], p[1], (p - middle).squaredNorm());
  // A point far above makes the hull solid even if all sites are on one circle.
  lifted.emplace_back(middle[0], middle[1], 4.0);
  const auto above = static_cast<uint32_t>(sites.size());
  std::vector<Triangle> triangles;
  for (const auto& [a, b, c] : lightfield::convexHull(lifted))
    if (a != above && b != above && c != above) triangles.push_back({a, c, b}); // as seen from above
  return tidied(std::move(triangles), sites);
}

std::vector<Triangle> delaunayTriangles(std::span<const DiscPoint> sites) {
  std::optional<std::vector<Triangle>> triangles = byInsertion(sites);
  return triangles ? tidied(std::move(*triangles), sites) : delaunayByHull(sites);
}

} // namespace surflect::lfm
