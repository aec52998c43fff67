#include "render/lightfield/slf/disc.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace surflect::slf {

namespace {

constexpr uint32_t kNone = ~0u;

// Directed edge of a triangle, by the vertices that it runs between.
struct Edge {
  uint32_t from, to, triangle;
};

} // namespace

std::vector<uint32_t> discBorder(std::span<const std::array<uint32_t, 3>> triangles, size_t vertices) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (uint32_t t = 0; t < triangles.size(); ++t)
    for (size_t k = 0; k < 3; ++k) edges.push_back({triangles[t][k], triangles[t][(k + 1) % 3], t});
  const auto ends = [](const Edge& edge) { return std::pair(edge.from, edge.to); };
  std::ranges::sort(edges, {}, ends);
  if (std::ranges::adjacent_find(edges, {}, ends) != edges.end()) return {};

  std::vector<uint32_t> parents(triangles.size()), next(vertices, kNone);
  for (uint32_t t = 0; t < parents.size(); ++t) parents[t] = t;
  size_t pieces = triangles.size(), borderEdges = 0;
  uint32_t start = kNone;
  for (const Edge& edge : edges) {
    const auto twin = std::ranges::lower_bound(edges, std::pair(edge.to, edge.from), {}, ends);
    if (twin != edges.end() && ends(*twin) == std::pair(edge.to, edge.from)) {
      const uint32_t a = rootOf(parents, edge.triangle), b = rootOf(parents, twin->triangle);
      if (a != b) parents[a] = b, --pieces;
    } else {
      if (next[edge.from] != kNone) return {};
      next[edge.from] = edge.to;
      start = std::min(start, edge.from);
      ++borderEdges;
    }
  }
  if (pieces != 1 || borderEdges < 3) return {};
  // Euler's characteristic: vertices - edges + triangles.
  const size_t allEdges = (edges.size() + borderEdges) / 2;
  if (vertices + triangles.size() != allEdges + 1) return {};
  std::vector<uint32_t> border;
  for (uint32_t v = start; v != kNone && border.size() < borderEdges; v = next[v]) border.push_back(v);
  return border.size() == borderEdges && next[border.back()] == start ? border : std::vector<uint32_t>();
}

std::vector<uint32_t> unitedLoop(std::span<const uint32_t> a, std::span<const uint32_t> b, size_t sharedEdges,
                                 std::span<const uint8_t> isPinched, std::span<uint32_t> order) {
  const size_t n = a.size(), m = b.size();
  if (sharedEdges == 0 || n + m < 2 * sharedEdges + 3) return {};
  // Each shared path, and each lone shared place, has one place more than edges. So sharedEdges + 1 shared
  // places mean exactly one path and nothing else.
  for (size_t j = 0; j < m; ++j) order[b[j]] = static_cast<uint32_t>(j) + 1;
  const auto sharedPlaces =
      static_cast<size_t>(std::ranges::count_if(a, [&](uint32_t v) { return order[v]; }));
  const auto isShared = [&](size_t i) { // edge from a[i], which b passes the other way
    const uint32_t from = order[a[i]], to = order[a[(i + 1) % n]];
    return from && to && from - 1 == to % m;
  };
  std::vector<uint32_t> loop;
  if (sharedPlaces == sharedEdges + 1) {
    size_t first = 0; // where the path starts in a
    while (!(isShared(first) && !isShared((first + n - 1) % n))) ++first;
    bool isLegal = true;
    for (size_t i = 1; i < sharedEdges; ++i) isLegal &= !isPinched[a[(first + i) % n]];
    if (isLegal) {
      for (size_t i = sharedEdges; i <= n; ++i) loop.push_back(a[(first + i) % n]);
      const size_t end = order[a[first]] - 1; // where the path ends in b
      for (size_t j = 1; j < m - sharedEdges; ++j) loop.push_back(b[(end + j) % m]);
    }
  }
  for (const uint32_t v : b) order[v] = 0;
  return loop;
}

std::optional<Disc> discOf(const TriangleMesh& mesh, const TriangleGraph& graph,
                           std::span<const uint32_t> triangles) {
  Disc disc;
  std::unordered_map<uint32_t, uint32_t> indices;
  for (const uint32_t t : triangles) {
    std::array<uint32_t, 3> corners;
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t place = graph.corners[t][k];
      const auto [at, isNew] = indices.try_emplace(place, static_cast<uint32_t>(disc.vertices.size()));
      if (isNew) {
        disc.vertices.push_back(place);
        disc.positions.push_back(mesh.positions[place].cast<double>().raw());
      }
      corners[k] = at->second;
    }
    disc.triangles.push_back(corners);
    disc.meshTriangles.push_back(t);
  }
  disc.border = discBorder(disc.triangles, disc.vertices.size());
  if (disc.border.empty()) return std::nullopt;
  return disc;
}

} // namespace surflect::slf
