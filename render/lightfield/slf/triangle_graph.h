// Triangles of a mesh and their neighbours. Vertices at one position count as one place throughout.
#pragma once

#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <array>
#include <cstdint>
#include <vector>

namespace surflect::slf {

inline constexpr uint32_t kNoTriangle = ~0u;

struct TriangleGraph {
  std::vector<std::array<uint32_t, 3>> corners; // #triangles; places: the first vertex at each position
  // #triangles; triangle across the edge from corner k to the next one. None at edges that have not exactly
  // two triangles, or where the two are wound differently.
  std::vector<std::array<uint32_t, 3>> neighbors;
  // #vertices; whether the triangles around a place are not all connected across its edges.
  std::vector<uint8_t> isPinched;
};

// Root of an element in a forest of parents, which shortens the path to it.
uint32_t rootOf(std::vector<uint32_t>& parents, uint32_t i);

// Throws Error for a corner beyond the vertices, for a triangle with two corners at one place, and for a
// position that is not finite; and Cancelled.
TriangleGraph triangleGraph(const TriangleMesh& mesh, const Progress& progress = {});

} // namespace surflect::slf
