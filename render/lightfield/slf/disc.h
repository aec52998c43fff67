// Disc: a part of a mesh that is homeomorphic to a disc, with vertices of its own.
#pragma once

#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::slf {

struct Disc {
  std::vector<uint32_t> vertices;                 // of the mesh: the first at each place
  std::vector<Vec3<double>> positions;            // of each vertex
  std::vector<std::array<uint32_t, 3>> triangles; // indices into vertices; corners in the mesh's order
  std::vector<uint32_t> meshTriangles;            // the mesh's triangle of each
  std::vector<uint32_t> border;                   // indices into vertices, counter-clockwise
};

// Disc of some triangles of a mesh. None unless they are connected across edges of two triangles, with one
// border loop that passes no vertex twice, and without handles.
std::optional<Disc> discOf(const TriangleMesh& mesh, const TriangleGraph& graph,
                           std::span<const uint32_t> triangles);

// Border loop of triangles over `vertices` vertices, as described above; empty if they are no disc.
std::vector<uint32_t> discBorder(std::span<const std::array<uint32_t, 3>> triangles, size_t vertices);

// Border of the union of two discs, given their borders: counter-clockwise loops of places. Empty unless the
// union is a disc: the loops share one path of `sharedEdges` edges and no other place, no place within the
// path is pinched, and what is left has at least three edges. `order` is scratch memory, #places of 0.
std::vector<uint32_t> unitedLoop(std::span<const uint32_t> a, std::span<const uint32_t> b, size_t sharedEdges,
                                 std::span<const uint8_t> isPinched, std::span<uint32_t> order);

} // namespace surflect::slf
