#include "render/lightfield/olf/delaunay.h"

#include "render/lightfield/lfm/view_blend.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <utility>

namespace surflect::olf {

namespace {

using lfm::DiscPoint, lfm::doubledArea;

constexpr uint32_t kNone = DelaunayTriangle::kNone;
constexpr uint32_t kInfinity = kNone - 1; // corner of triangles beyond the hull
constexpr double kRounding = 1e-15;       // relative, of sums of products
constexpr double kEqual = 1e-20;          // squared distance of equal sites

// Whether p is within the circumcircle of a counter-clockwise triangle, by more than rounding.
bool isInCircle(const DiscPoint& a, const DiscPoint& b, const DiscPoint& c, const DiscPoint& p) {
  const DiscPoint u = a - p, v = b - p, w = c - p;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), ww = w.squaredNorm();
  const double sum =
      uu * (v[0] * w[1] - v[1] * w[0]) - vv * (u[0] * w[1] - u[1] * w[0]) + ww * (u[0] * v[1] - u[1] * v[0]);
  const double size = uu * (std::abs(v[0] * w[1]) + std::abs(v[1] * w[0])) +
                      vv * (std::abs(u[0] * w[1]) + std::abs(u[1] * w[0])) +
                      ww * (std::abs(u[0] * v[1]) + std::abs(u[1] * v[0]));
  return sum > 8 * kRounding * size;
}

// Sites in an order in which each is near the one before: along rows of a grid, there and back.
std::vector<uint32_t> serpentine(std::span<const DiscPoint> sites) {
  Eigen::AlignedBox2d box;
  for (const DiscPoint& site : sites) box.extend(site);
  const double rows = std::ceil(std::sqrt(static_cast<double>(sites.size()) / 2));
  const double height = std::max(box.sizes()[1], 1e-300) / rows;
  std::vector<std::pair<double, double>> keys;
  for (const DiscPoint& site : sites) {
    const double row = std::min(std::floor((site[1] - box.min()[1]) / height), rows - 1);
    keys.emplace_back(row, std::fmod(row, 2) == 0 ? site[0] : -site[0]);
  }
  std::vector<uint32_t> order(sites.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, {}, [&](uint32_t i) { return keys[i]; });
  return order;
}

class Insertion {
public:
  // From a triangle of three sites, counter-clockwise.
  Insertion(std::span<const DiscPoint> sites, const std::array<uint32_t, 3>& first) : sites_(sites) {
    const auto& [a, b, c] = first;
    triangles_ = {{{a, b, c}, {1, 2, 3}},
                  {{c, b, kInfinity}, {3, 2, 0}},
                  {{a, c, kInfinity}, {1, 3, 0}},
                  {{b, a, kInfinity}, {2, 1, 0}}};
  }

  // Returns false if the walk to the site or the flips have no end, by rounding.
  bool insert(uint32_t site) {
    const std::optional<uint32_t> found = triangleAt(sites_[site]);
    if (!found) return false;
    for (const uint32_t corner : triangles_[*found].corners)
      if (corner != kInfinity && (sites_[corner] - sites_[site]).squaredNorm() < kEqual) return true;
    // Triangle `inside` becomes that of the edge opposite to its corner 2, two new ones follow.
    const uint32_t inside = *found, second = static_cast<uint32_t>(triangles_.size()), third = second + 1;
    const DelaunayTriangle old = triangles_[inside];
    const auto& [a, b, c] = old.corners;
    const auto& [ofA, ofB, ofC] = old.neighbors;
    triangles_[inside] = {{a, b, site}, {second, third, ofC}};
    triangles_.push_back({{b, c, site}, {third, inside, ofA}});
    triangles_.push_back({{c, a, site}, {inside, second, ofB}});
    replaceNeighbor(ofA, inside, second);
    replaceNeighbor(ofB, inside, third);
    last_ = inside;
    return flipAround({inside, second, third});
  }

  std::vector<DelaunayTriangle> result() const {
    std::vector<uint32_t> placeOf(triangles_.size(), kNone);
    std::vector<DelaunayTriangle> kept;
    for (size_t t = 0; t < triangles_.size(); ++t)
      if (!isBeyond(triangles_[t]) && area(triangles_[t]) > lfm::kLeastArea) {
        placeOf[t] = static_cast<uint32_t>(kept.size());
        kept.push_back(triangles_[t]);
      }
    for (DelaunayTriangle& triangle : kept)
      for (uint32_t& neighbor : triangle.neighbors) neighbor = placeOf[neighbor];
    return kept;
  }

  // Whether no triangle is turned over, and the hull is convex, up to rounding.
  bool isRight() const {
    return std::ranges::all_of(triangles_, [&](const DelaunayTriangle& triangle) {
      return isBeyond(triangle) ? isConvexBehind(triangle) : area(triangle) > -lfm::kLeastArea;
    });
  }

private:
  static bool isBeyond(const DelaunayTriangle& triangle) {
    return std::ranges::find(triangle.corners, kInfinity) != triangle.corners.end();
  }
  double area(const DelaunayTriangle& triangle) const {
    const auto& [a, b, c] = triangle.corners;
    return doubledArea(sites_[a], sites_[b], sites_[c]);
  }
  // The edge of a triangle beyond the hull: what is left of it is beyond.
  static std::array<uint32_t, 2> edgeOf(const DelaunayTriangle& beyond) {
    const auto at =
        static_cast<size_t>(std::ranges::find(beyond.corners, kInfinity) - beyond.corners.begin());
    return {beyond.corners[(at + 1) % 3], beyond.corners[(at + 2) % 3]};
  }
  bool isConvexBehind(const DelaunayTriangle& beyond) const {
    const auto [from, to] = edgeOf(beyond);
    const auto at =
        static_cast<size_t>(std::ranges::find(beyond.corners, kInfinity) - beyond.corners.begin());
    // Across the edge from `from` to infinity: the next edge of the hull, which ends at `from`.
    const auto [start, end] = edgeOf(triangles_[beyond.neighbors[(at + 2) % 3]]);
    const uint32_t other = start == to ? end : start;
    return doubledArea(sites_[from], sites_[to], sites_[other]) < lfm::kLeastArea;
  }

  // Positive if p is on the left of the edge opposite to a corner.
  double leftOf(const DelaunayTriangle& triangle, size_t corner, const DiscPoint& p) const {
    const uint32_t from = triangle.corners[(corner + 1) % 3], to = triangle.corners[(corner + 2) % 3];
    if (from == kInfinity || to == kInfinity) return 0;
    return doubledArea(sites_[from], sites_[to], p);
  }

  std::optional<uint32_t> triangleAt(const DiscPoint& p) const {
    uint32_t at = last_;
    if (isBeyond(triangles_[at])) {
      const DelaunayTriangle& beyond = triangles_[at];
      for (size_t corner = 0; corner < 3; ++corner)
        if (beyond.corners[corner] == kInfinity) at = beyond.neighbors[corner];
    }
    for (size_t step = 0; step < triangles_.size(); ++step) {
      const DelaunayTriangle& triangle = triangles_[at];
      if (isBeyond(triangle)) return at;
      size_t worst = 0;
      double least = 0;
      for (size_t corner = 0; corner < 3; ++corner)
        if (const double left = leftOf(triangle, corner, p); left < least) least = left, worst = corner;
      if (least >= -kRounding) return at;
      at = triangle.neighbors[worst];
    }
    return std::nullopt;
  }

  // Whether a triangle must not stay beside p, which is across one of its edges.
  bool holds(const DelaunayTriangle& triangle, const DiscPoint& p) const {
    if (isBeyond(triangle)) {
      const auto [from, to] = edgeOf(triangle);
      return doubledArea(sites_[from], sites_[to], p) > kRounding;
    }
    const auto& [a, b, c] = triangle.corners;
    return isInCircle(sites_[a], sites_[b], sites_[c], p);
  }

  void replaceNeighbor(uint32_t triangle, uint32_t before, uint32_t after) {
    for (uint32_t& neighbor : triangles_[triangle].neighbors)
      if (neighbor == before) {
        neighbor = after;
        return;
      }
  }

  // Flips edges opposite to the new site, which is corner 2 of the given triangles.
  bool flipAround(std::vector<uint32_t> open) {
    for (size_t flips = 0; !open.empty();) {
      const uint32_t t = open.back();
      open.pop_back();
      const uint32_t across = triangles_[t].neighbors[2];
      const auto [a, b, site] = triangles_[t].corners;
      if (!holds(triangles_[across], sites_[site])) continue;
      const DelaunayTriangle other = triangles_[across];
      size_t at = 0; // of the corner opposite to the edge
      while (at < 3 && (other.neighbors[at] != t || other.corners[at] == a || other.corners[at] == b)) ++at;
      if (at == 3 || ++flips > triangles_.size()) return false;
      const uint32_t opposite = other.corners[at];
      // `other` runs opposite, b, a: its corner at + 1 is b.
      const uint32_t beyondA = other.neighbors[(at + 1) % 3], beyondB = other.neighbors[(at + 2) % 3];
      const uint32_t ofA = triangles_[t].neighbors[0], ofB = triangles_[t].neighbors[1];
      triangles_[t] = {{a, opposite, site}, {across, ofB, beyondA}};
      triangles_[across] = {{opposite, b, site}, {ofA, t, beyondB}};
      replaceNeighbor(beyondA, across, t);
      replaceNeighbor(ofA, t, across);
      open.push_back(t);
      open.push_back(across);
    }
    return true;
  }

  std::span<const DiscPoint> sites_;
  std::vector<DelaunayTriangle> triangles_;
  uint32_t last_ = 0; // from which the next walk starts
};

// First of a long edge and the site farthest from it, counter-clockwise; none if all are nearly in a line.
std::optional<std::array<uint32_t, 3>> firstTriangle(std::span<const DiscPoint> sites, uint32_t a) {
  const auto farthest = [&](const auto& distance) {
    uint32_t best = 0;
    for (uint32_t i = 1; i < sites.size(); ++i)
      if (distance(sites[i]) > distance(sites[best])) best = i;
    return best;
  };
  const uint32_t b = farthest([&](const DiscPoint& p) { return (p - sites[a]).squaredNorm(); });
  const uint32_t c =
      farthest([&](const DiscPoint& p) { return std::abs(doubledArea(sites[a], sites[b], p)); });
  const double area = doubledArea(sites[a], sites[b], sites[c]);
  if (!(std::abs(area) > lfm::kLeastArea)) return std::nullopt;
  return area > 0 ? std::array{a, b, c} : std::array{a, c, b};
}

std::vector<DelaunayTriangle> byQhull(std::span<const DiscPoint> sites) {
  std::vector<DelaunayTriangle> triangles;
  struct Edge {
    uint32_t from, to, triangle, corner;
  };
  std::vector<Edge> edges;
  for (const auto& corners : lfm::delaunayTriangles(sites)) {
    for (uint32_t k = 0; k < 3; ++k)
      edges.push_back(
          {corners[(k + 1) % 3], corners[(k + 2) % 3], static_cast<uint32_t>(triangles.size()), k});
    triangles.push_back({corners, {kNone, kNone, kNone}});
  }
  const auto ends = [](const Edge& edge) { return std::pair(edge.from, edge.to); };
  std::ranges::sort(edges, {}, ends);
  for (const Edge& edge : edges)
    if (const auto across = std::ranges::lower_bound(edges, std::pair(edge.to, edge.from), {}, ends);
        across != edges.end() && ends(*across) == std::pair(edge.to, edge.from))
      triangles[edge.triangle].neighbors[edge.corner] = across->triangle;
  return triangles;
}

} // namespace

std::vector<DelaunayTriangle> delaunay(std::span<const DiscPoint> sites) {
  if (sites.size() < 3) return {};
  const std::vector<uint32_t> order = serpentine(sites);
  const auto first = firstTriangle(sites, order[0]);
  if (!first) return {};
  Insertion insertion(sites, *first);
  for (const uint32_t site : order)
    if (std::ranges::find(*first, site) == first->end() && !insertion.insert(site)) return byQhull(sites);
  return insertion.isRight() ? insertion.result() : byQhull(sites);
}

} // namespace surflect::olf
