#include "surfel/geometry/mesh_topology.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <numeric>
#include <tuple>

namespace surflect {

namespace {

constexpr uint32_t kNoTriangle = ~0u;

// Triangle across an edge.
struct Neighbor {
  uint32_t triangle = kNoTriangle;
  bool isWoundAlike = true;
};

// Side of a triangle, by its vertices, the lower one first.
struct Side {
  uint32_t low, high;
  uint32_t triangle;
  uint8_t side;
  bool rises; // from the lower vertex to the higher one in the triangle's winding

  auto ends() const { return std::pair(low, high); }
};

std::vector<std::array<Neighbor, 3>> neighborsIn(const TriangleMesh& mesh, const Progress& progress) {
  const std::vector<uint32_t> place = firstAtPlace(mesh, progress);
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (uint8_t k = 0; k < 3; ++k) {
      const uint32_t from = place[mesh.triangles[t][k]], to = place[mesh.triangles[t][(k + 1u) % 3]];
      sides.push_back({std::min(from, to), std::max(from, to), t, k, from < to});
    }
  tbb::parallel_sort(sides, [&](const Side& a, const Side& b) {
    return std::tuple(a.low, a.high, a.triangle, a.side) < std::tuple(b.low, b.high, b.triangle, b.side);
  });
  progress.checkpoint();

  std::vector<std::array<Neighbor, 3>> neighbors(mesh.triangles.size());
  for (size_t first = 0, end = 0; first < sides.size(); first = end) {
    while (end < sides.size() && sides[end].ends() == sides[first].ends()) ++end;
    if (end - first != 2) continue;
    const Side &a = sides[first], &b = sides[first + 1];
    const bool isWoundAlike = a.rises != b.rises;
    neighbors[a.triangle][a.side] = {b.triangle, isWoundAlike};
    neighbors[b.triangle][b.side] = {a.triangle, isWoundAlike};
  }
  return neighbors;
}

} // namespace

std::vector<uint32_t> firstAtPlace(const TriangleMesh& mesh, const Progress& progress) {
  std::vector<uint32_t> order(mesh.positions.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto placeOf = [&](uint32_t vertex) {
    const auto& p = mesh.positions[vertex];
    return std::tuple(p.x(), p.y(), p.z());
  };
  tbb::parallel_sort(order, [&](uint32_t a, uint32_t b) {
    progress.checkNowAndThen(a);
    return std::tuple(placeOf(a), a) < std::tuple(placeOf(b), b);
  });
  std::vector<uint32_t> first(order.size());
  for (size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && placeOf(order[i]) == placeOf(order[i - 1]) ? first[order[i - 1]] : order[i];
  return first;
}

Repeats repeatsIn(const TriangleMesh& mesh, const Progress& progress) {
  const std::vector<uint32_t> place = firstAtPlace(mesh, progress);
  struct Entry {
    std::array<uint32_t, 3> corners; // in rising order
    uint32_t triangle;
    bool isOdd; // parity of the permutation of the winding
  };
  std::vector<Entry> entries;
  entries.reserve(mesh.triangles.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    Entry entry{{place[a], place[b], place[c]}, t, false};
    const auto& p = entry.corners;
    entry.isOdd = (p[0] > p[1]) ^ (p[1] > p[2]) ^ (p[0] > p[2]);
    std::ranges::sort(entry.corners);
    entries.push_back(entry);
  }
  tbb::parallel_sort(entries, [&](const Entry& a, const Entry& b) {
    progress.checkNowAndThen(a.triangle);
    return std::tie(a.corners, a.triangle) < std::tie(b.corners, b.triangle);
  });

  Repeats repeats{std::vector<uint32_t>(mesh.triangles.size()),
                  std::vector<uint8_t>(mesh.triangles.size(), 0)};
  for (size_t first = 0, end = 0; first < entries.size(); first = end) {
    bool hasBack = false;
    for (; end < entries.size() && entries[end].corners == entries[first].corners; ++end) {
      const bool isBack = entries[end].isOdd != entries[first].isOdd && !hasBack;
      repeats.first[entries[end].triangle] = entries[first].triangle;
      repeats.isBack[entries[end].triangle] = isBack;
      hasBack |= isBack;
    }
  }
  return repeats;
}

MeshParts partsOf(const TriangleMesh& mesh, const Progress& progress) {
  const auto neighbors = neighborsIn(mesh, progress);
  MeshParts result;
  result.isAgainst.assign(mesh.triangles.size(), 0);
  std::vector<uint8_t> isReached(mesh.triangles.size(), 0);
  for (uint32_t seed = 0; seed < mesh.triangles.size(); ++seed) {
    if (isReached[seed]) continue;
    MeshParts::Part part;
    double areaAgainst = 0; // area wound against the seed
    part.triangles.push_back(seed);
    isReached[seed] = 1;
    for (size_t i = 0; i < part.triangles.size(); ++i) {
      progress.checkNowAndThen(i);
      const uint32_t t = part.triangles[i];
      const double area = areaVector(mesh, t).norm() / 2;
      part.area += area;
      areaAgainst += result.isAgainst[t] ? area : 0;
      for (const uint32_t v : mesh.triangles[t]) part.box.extend(mesh.positions[v].cast<double>().raw());
      for (const Neighbor& neighbor : neighbors[t]) {
        if (neighbor.triangle == kNoTriangle) continue;
        const uint8_t against = neighbor.isWoundAlike ? result.isAgainst[t] : !result.isAgainst[t];
        if (isReached[neighbor.triangle]) {
          part.isOrientable &= result.isAgainst[neighbor.triangle] == against;
          continue;
        }
        isReached[neighbor.triangle] = 1;
        result.isAgainst[neighbor.triangle] = against;
        part.triangles.push_back(neighbor.triangle);
      }
    }
    std::ranges::sort(part.triangles);
    for (const uint32_t t : part.triangles)
      result.isAgainst[t] = part.isOrientable && result.isAgainst[t] != (2 * areaAgainst > part.area);
    result.parts.push_back(std::move(part));
  }
  return result;
}

} // namespace surflect
