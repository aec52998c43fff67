#include "srf/proxy/mesh/enclosed.h"

#include "surfel/base/text.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace surflect::proxy {

namespace {

using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

constexpr size_t kPerTask = 1024;
constexpr size_t kAskedOfRegion = 8; // vertices

Point inFrontOf(const RayCaster<AcquisitionSpace>& rays, const Point& surface, const Vec3<double>& normal) {
  return surface + assume<Direction>(4 * rays.selfHitOffset() * normal);
}

bool isEnclosed(const RayCaster<AcquisitionSpace>& rays, const Point& p) {
  // All around, and along no edge of a tidy mesh.
  static const std::array<Direction, 6> probes = {
      normalized(Direction(0.811, 0.337, 0.479)),  normalized(Direction(-0.431, 0.859, 0.277)),
      normalized(Direction(0.283, -0.617, 0.733)), normalized(Direction(-0.709, -0.383, 0.593)),
      normalized(Direction(0.467, 0.251, -0.847)), normalized(Direction(-0.353, -0.547, -0.761))};
  // A ray into the open ends the search, and is the cheapest to ask for.
  const auto isBlocked = [&](const Direction& direction) {
    return rays.occluded(p, direction, 0, std::numeric_limits<double>::infinity());
  };
  const auto isInside = [&](const Direction& direction) { return rays.winding(p, direction) > 0; };
  return std::ranges::all_of(probes, isBlocked) && std::ranges::all_of(probes, isInside);
}

// Returns true if the segment between two points meets no surface.
bool isFree(const RayCaster<AcquisitionSpace>& rays, const Point& from, const Point& to) {
  const double distance = length(to - from);
  return distance > 0 && !rays.occluded(from, normalized(to - from), 0, distance);
}

// Returns true if the points in front of a triangle, sampled at most `pitch` apart, are all enclosed. The
// points in front of its corners are known to be enclosed; `corner` is one of them. A point that a free
// segment connects with `corner` lies in the same region of space, so that it needs no test of its own.
bool isEnclosedAll(const RayCaster<AcquisitionSpace>& rays, const TriangleMesh& mesh, size_t triangle,
                   const Point& corner, double pitch, const Progress& progress) {
  const auto place = [&](size_t i) -> Vec3<double> {
    return mesh.positions[mesh.triangles[triangle][i]].cast<double>().raw();
  };
  const Vec3<double> p = place(0), q = place(1) - p, r = place(2) - p, normal = areaVector(mesh, triangle);
  if (!(normal.squaredNorm() > 0)) return true; // no area
  const auto steps = static_cast<int>(std::ceil(std::max({q.norm(), r.norm(), (q - r).norm()}) / pitch));
  for (int i = 0; i <= steps; ++i) {
    progress.checkpoint();
    for (int j = 0; j <= steps - i; ++j) {
      if (i % steps + j % steps == 0) continue; // a corner
      const Point point = inFrontOf(rays, assume<Point>(p + (i * q + j * r) / steps), normal.normalized());
      if (!isFree(rays, corner, point) && !isEnclosed(rays, point)) return false;
    }
  }
  return true;
}

using Edge = std::pair<uint32_t, uint32_t>; // the smaller vertex first

std::vector<Edge> edgesOf(const TriangleMesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    for (const auto& [from, to] : {Edge(a, b), Edge(b, c), Edge(c, a)})
      edges.push_back(std::minmax(from, to));
  tbb::parallel_sort(edges);
  const auto repeated = std::ranges::unique(edges);
  edges.erase(repeated.begin(), repeated.end());
  return edges;
}

// Sets of vertices, each known by its smallest [Tarjan 1975, union by index with path halving].
class Regions {
public:
  explicit Regions(size_t vertices) : parent_(vertices) { std::iota(parent_.begin(), parent_.end(), 0u); }

  uint32_t of(uint32_t vertex) {
    while (parent_[vertex] != vertex) vertex = parent_[vertex] = parent_[parent_[vertex]];
    return vertex;
  }
  void unite(uint32_t a, uint32_t b) {
    const auto [smaller, larger] = std::minmax({of(a), of(b)}); // by value
    parent_[larger] = smaller;
  }

private:
  std::vector<uint32_t> parent_;
};

template <class Work> void forEach(size_t count, const Progress& progress, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kPerTask),
                    [&](const tbb::blocked_range<size_t>& range) {
                      progress.checkpoint();
                      for (size_t i = range.begin(); i < range.end(); ++i) work(i);
                    });
}

// Vertices in front of which space is enclosed. `front` is empty where a vertex has no normal.
std::vector<uint8_t> enclosedVertices(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays,
                                      const std::vector<std::optional<Point>>& front,
                                      const Progress& progress) {
  const std::vector<Edge> edges = edgesOf(mesh);
  std::vector<uint8_t> isOpen(edges.size());
  forEach(edges.size(), progress, [&](size_t e) {
    const auto &from = front[edges[e].first], &to = front[edges[e].second];
    if (!from || !to) return;
    isOpen[e] = isFree(rays, *from, *to);
  });
  Regions regions(front.size());
  for (size_t e = 0; e < edges.size(); ++e)
    if (isOpen[e]) regions.unite(edges[e].first, edges[e].second);

  std::vector<std::vector<uint32_t>> members(front.size()); // of regions, by their smallest vertex
  std::vector<uint32_t> all;                                // regions
  for (uint32_t v = 0; v < front.size(); ++v) {
    if (!front[v]) continue;
    auto& region = members[regions.of(v)];
    if (region.empty()) all.push_back(regions.of(v));
    region.push_back(v);
  }
  std::vector<uint8_t> isInside(front.size()), isUnsure(all.size());
  forEach(all.size(), progress, [&](size_t r) {
    const std::vector<uint32_t>& region = members[all[r]];
    const std::vector<size_t> asked = evenlySpaced(region.size(), kAskedOfRegion);
    size_t enclosed = 0;
    for (const size_t i : asked) enclosed += isEnclosed(rays, *front[region[i]]);
    isUnsure[r] = enclosed > 0 && enclosed < asked.size();
    for (const uint32_t v : region) isInside[v] = enclosed == asked.size();
  });
  std::vector<uint32_t>
      unsure; // vertices of regions whose vertices disagree: open surfaces, rays along edges
  for (size_t r = 0; r < all.size(); ++r)
    if (isUnsure[r]) unsure.insert(unsure.end(), members[all[r]].begin(), members[all[r]].end());
  forEach(unsure.size(), progress,
          [&](size_t i) { isInside[unsure[i]] = isEnclosed(rays, *front[unsure[i]]); });
  return isInside;
}

} // namespace

TriangleMesh withoutEnclosed(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays, double pitch,
                             const Progress& progress) {
  // Means of the normals around the vertices, by area.
  std::vector<Vec3<double>> normals(mesh.positions.size(), Vec3<double>::Zero());
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t vertex : mesh.triangles[t]) normals[vertex] += areaVector(mesh, t);
  std::vector<std::optional<Point>> front(mesh.positions.size());
  for (size_t v = 0; v < front.size(); ++v)
    if (normals[v].squaredNorm() > 0)
      front[v] = inFrontOf(rays, mesh.positions[v].cast<double>(), normals[v].normalized());
  const std::vector<uint8_t> isCornerInside = enclosedVertices(mesh, rays, front, progress);
  std::vector<uint8_t> isInside(mesh.triangles.size());
  forEach(mesh.triangles.size(), progress, [&](size_t t) {
    const auto& corners = mesh.triangles[t];
    isInside[t] = std::ranges::all_of(corners, [&](uint32_t v) { return isCornerInside[v] != 0; }) &&
                  isEnclosedAll(rays, mesh, t, *front[corners[0]], pitch, progress);
  });
  TriangleMesh open{mesh.positions, {}};
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!isInside[t]) open.triangles.push_back(mesh.triangles[t]);
  return open.triangles.empty() ? mesh : open;
}

} // namespace surflect::proxy
