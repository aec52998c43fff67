// Lumigraph in memory: the pictures of all nodes of six slabs, and the geometry that corrects depth.
//
// [Gortler 1996] Gortler, Grzeszczuk, Szeliski, Cohen: The Lumigraph.
#pragma once

#include "render/lightfield/lumigraph/depth_geometry.h"
#include "render/lightfield/lumigraph/slab.h"

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
  DepthGeometry geometry;

  std::span<const Texel> picture(size_t slab, int i, int j) const {
    const Slab& shape = slabs[slab];
    const auto node = static_cast<size_t>(i + j * shape.nodes);
    return std::span(texels[slab]).subspan(node * shape.nodeTexels(), shape.nodeTexels());
  }
};

} // namespace surflect::lumigraph
