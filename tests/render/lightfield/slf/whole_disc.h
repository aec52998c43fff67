// A whole mesh as one disc.
#pragma once

#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>
#include <numeric>
#include <optional>
#include <vector>

namespace surflect::slf {

// None if the mesh is no disc.
inline std::optional<Disc> discOfAll(const TriangleMesh& mesh) {
  std::vector<uint32_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  return discOf(mesh, triangleGraph(mesh), all);
}

inline Disc wholeOf(const TriangleMesh& mesh) { return discOfAll(mesh).value(); }

} // namespace surflect::slf
