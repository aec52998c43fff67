#include "surfel/geometry/simplify.h"

#include "surfel/geometry/mesh_topology.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <utility>
#include <vector>

namespace surflect {

namespace {

// The mesh with one vertex at each position: to the library, others at its place would be seams.
TriangleMesh welded(const TriangleMesh& mesh) {
  const std::vector<uint32_t> first = firstAtPlace(mesh);
  TriangleMesh result = mesh;
  for (auto& triangle : result.triangles)
    for (uint32_t& corner : triangle) corner = first[corner];
  return withoutUnused(std::move(result));
}

} // namespace

TriangleMesh simplified(const TriangleMesh& mesh, size_t triangles, double farthest) {
  assert(triangles >= 1 && farthest >= 0);
  if (mesh.triangles.size() <= triangles) return withoutUnused(mesh);
  TriangleMesh result = welded(mesh);
  static_assert(sizeof(result.positions[0]) == 3 * sizeof(float));
  static_assert(sizeof(result.triangles[0]) == 3 * sizeof(uint32_t));
  const auto* positions = reinterpret_cast<const float*>(result.positions.data());
  const size_t corners = 3 * result.triangles.size();
  const auto extent = static_cast<double>(
      meshopt_simplifyScale(positions, result.positions.size(), sizeof(result.positions[0])));
  const double error = extent > 0 ? std::min(1., farthest / extent) : 1;
  std::vector<std::array<uint32_t, 3>> kept(result.triangles.size());
  const size_t count = meshopt_simplify(kept.front().data(), result.triangles.front().data(), corners,
                                        positions, result.positions.size(), sizeof(result.positions[0]),
                                        3 * triangles, static_cast<float>(error), 0, nullptr);
  kept.resize(count / 3);
  result.triangles = std::move(kept);
  return withoutUnused(std::move(result));
}

} // namespace surflect
