#include "surfel/geometry/simplify.h"

#include "surfel/geometry/mesh_topology.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace surflect {

TriangleMesh simplified(const TriangleMesh& mesh, size_t triangles) {
  assert(triangles >= 1);
  if (mesh.triangles.size() <= triangles) return withoutUnused(mesh);
  const std::vector<uint32_t> first = firstAtPlace(mesh);
  std::vector<uint32_t> corners;
  for (const auto& triangle : mesh.triangles)
    for (const uint32_t corner : triangle) corners.push_back(first[corner]);
  static_assert(sizeof(mesh.positions[0]) == 3 * sizeof(float));
  const auto* positions = reinterpret_cast<const float*>(mesh.positions.data());
  std::vector<uint32_t> kept(corners.size());
  kept.resize(meshopt_simplify(kept.data(), corners.data(), corners.size(), positions, mesh.positions.size(),
                               sizeof(mesh.positions[0]), 3 * triangles, std::numeric_limits<float>::max(), 0,
                               nullptr));
  TriangleMesh result{mesh.positions, {}};
  for (size_t i = 0; i + 2 < kept.size(); i += 3)
    result.triangles.push_back({kept[i], kept[i + 1], kept[i + 2]});
  return withoutUnused(std::move(result));
}

} // namespace surflect
