#include "surfel/geometry/simplify.h"

#include "surfel/geometry/mesh_topology.h"

#include <meshoptimizer.h>

#include <array>
#include <cassert>
#include <cstdint>
#include <utility>
#include <vector>

namespace surflect {

namespace {

// Largest distance that the surface may move, as a part of its extent.
constexpr float kLargestError = 1;

// The mesh with one vertex at each position: to the library, others at its place would be seams.
TriangleMesh welded(const TriangleMesh& mesh) {
  const std::vector<uint32_t> first = firstAtPlace(mesh);
  TriangleMesh result = mesh;
  for (auto& triangle : result.triangles)
    for (uint32_t& corner : triangle) corner = first[corner];
  return withoutUnused(std::move(result));
}

} // namespace

TriangleMesh simplified(const TriangleMesh& mesh, size_t triangles) {
  assert(triangles >= 1);
  if (mesh.triangles.size() <= triangles) return withoutUnused(mesh);
  TriangleMesh result = welded(mesh);
  static_assert(sizeof(result.positions[0]) == 3 * sizeof(float));
  static_assert(sizeof(result.triangles[0]) == 3 * sizeof(uint32_t));
  const auto* positions = reinterpret_cast<const float*>(result.positions.data());
  const size_t corners = 3 * result.triangles.size();
  std::vector<std::array<uint32_t, 3>> kept(result.triangles.size());
  const size_t count = meshopt_simplify(kept.front().data(), result.triangles.front().data(), corners,
                                        positions, result.positions.size(), sizeof(result.positions[0]),
                                        3 * triangles, kLargestError, 0, nullptr);
  kept.resize(count / 3);
  result.triangles = std::move(kept);
  return withoutUnused(std::move(result));
}

} // namespace surflect
