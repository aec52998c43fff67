// Lumigraph in memory: the pictures of all nodes of six slabs, and the geometry that corrects depth.
//
// [Gortler 1996] Gortler, Grzeszczuk, Szeliski, Cohen: The Lumigraph.
#pragma once

#include "render/lightfield/lumigraph/slab.h"
#include "surfel/geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lumigraph {

// Half floats r, g, b of linear radiance, and 1 where the texel's line meets the object, else 0. Colours
// beside the object are smooth continuations of those on it. All are finite.
using Texel = std::array<uint16_t, 4>;

struct Lumigraph {
  Slabs slabs;
  double overlap = 0; // see slabWeights()
  // Pictures of each slab: node (i, j) is picture i + j * nodes; row 0 has v = 1/2.
  std::array<std::vector<Texel>, kSlabs> texels;
  // Geometry on which rays are brought to the same point: the object's own, or a simplified one.
  TriangleMesh geometry;
  // A surface around the object for pixels that a simplified geometry misses (depth_geometry.h); or empty.
  TriangleMesh fringe;
  // Whether the geometry's outline is the object's. If not, texels tell where the object ends.
  bool exactOutline = true;

  std::span<const Texel> picture(size_t slab, int i, int j) const {
    const Slab& shape = slabs[slab];
    const auto node = static_cast<size_t>(i + j * shape.nodes);
    return std::span(texels[slab]).subspan(node * shape.nodeTexels(), shape.nodeTexels());
  }
};

} // namespace surflect::lumigraph
