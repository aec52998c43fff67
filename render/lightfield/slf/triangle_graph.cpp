#include "render/lightfield/slf/triangle_graph.h"

#include "surfel/base/error.h"
#include "surfel/geometry/mesh_topology.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

namespace surflect::slf {

namespace {

// Directed edge of a triangle, from corner `side` to the next.
struct Side {
  uint32_t low, high; // its places in rising order
  uint32_t triangle;
  uint8_t side;
  bool rises; // from low to high

  auto ends() const { return std::pair(low, high); }
};

void requireSound(const TriangleMesh& mesh) {
  for (size_t v = 0; v < mesh.positions.size(); ++v)
    if (!mesh.positions[v].raw().allFinite())
      throw Error("is not finite").at("positions[" + std::to_string(v) + ']');
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t corner : mesh.triangles[t])
      if (corner >= mesh.positions.size())
        throw Error::mismatch("a vertex below " + std::to_string(mesh.positions.size()),
                              std::to_string(corner))
            .at("triangles[" + std::to_string(t) + ']');
}

} // namespace

uint32_t rootOf(std::vector<uint32_t>& parents, uint32_t i) {
  while (parents[i] != i) i = parents[i] = parents[parents[i]];
  return i;
}

TriangleGraph triangleGraph(const TriangleMesh& mesh, const Progress& progress) {
  requireSound(mesh);
  const std::vector<uint32_t> place = firstAtPlace(mesh, progress);
  TriangleGraph graph;
  const size_t count = mesh.triangles.size();
  graph.corners.resize(count);
  graph.neighbors.assign(count, {kNoTriangle, kNoTriangle, kNoTriangle});

  std::vector<Side> sides;
  sides.reserve(3 * count);
  for (uint32_t t = 0; t < count; ++t) {
    for (size_t k = 0; k < 3; ++k) graph.corners[t][k] = place[mesh.triangles[t][k]];
    for (uint8_t k = 0; k < 3; ++k) {
      const uint32_t from = graph.corners[t][k], to = graph.corners[t][(k + 1u) % 3];
      if (from == to)
        throw Error("has two corners at one place; expected a triangle with an area")
            .at("triangles[" + std::to_string(t) + ']');
      sides.push_back({std::min(from, to), std::max(from, to), t, k, from < to});
    }
  }
  tbb::parallel_sort(sides, [](const Side& a, const Side& b) {
    return std::tuple(a.low, a.high, a.triangle, a.side) < std::tuple(b.low, b.high, b.triangle, b.side);
  });
  progress.checkpoint();

  // Corners 3 t + k that are connected around their place.
  std::vector<uint32_t> fans(3 * count);
  std::iota(fans.begin(), fans.end(), 0u);
  const auto connect = [&](uint32_t a, uint32_t b) {
    a = rootOf(fans, a), b = rootOf(fans, b);
    fans[std::max(a, b)] = std::min(a, b);
  };
  for (size_t first = 0, end = 0; first < sides.size(); first = end) {
    while (end < sides.size() && sides[end].ends() == sides[first].ends()) ++end;
    if (end - first != 2) continue;
    const Side &a = sides[first], &b = sides[first + 1];
    if (a.rises == b.rises) continue;
    graph.neighbors[a.triangle][a.side] = b.triangle;
    graph.neighbors[b.triangle][b.side] = a.triangle;
    connect(3 * a.triangle + a.side, 3 * b.triangle + (b.side + 1u) % 3);
    connect(3 * a.triangle + (a.side + 1u) % 3, 3 * b.triangle + b.side);
  }

  graph.isPinched.assign(mesh.positions.size(), 0);
  std::vector<uint32_t> fanOfPlace(mesh.positions.size(), ~0u);
  for (uint32_t corner = 0; corner < 3 * count; ++corner) {
    const uint32_t at = graph.corners[corner / 3][corner % 3], fan = rootOf(fans, corner);
    if (fanOfPlace[at] == ~0u) fanOfPlace[at] = fan;
    graph.isPinched[at] |= fanOfPlace[at] != fan;
  }
  return graph;
}

} // namespace surflect::slf
