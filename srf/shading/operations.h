// Operations of the shading queue, after [Weyrich 2005, Table 2]. An operation of the paper is one look-up
// for a surfel, camera and light. Here, an operation has one camera and all lights: they share the position
// in the image, hence blocks and texels, and their weights are applied to the factor A of X ~ E A before any
// texel is read.
#pragma once

#include "srf/shading/block_lookup.h"
#include "surfel/base/uninitialized_vector.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::shading {

struct ShadingOp {
  uint32_t target = 0; // index of the radiance that the operation adds to
  uint32_t view = 0;   // index of the view
  float x = 0, y = 0;  // projection of the surfel in pixels, centres at +0.5; clamped to the image
  float weight = 0;    // camera weight
  uint32_t rowBegin = 0, rowEnd = 0; // light row: a range of LightRows::lights
};

// Light rows of surfels: a row is a range of `lights`. Captured lights are blended before they are coloured:
// n of them cost n + 3 products for each term of a block, and 4 n if each had its own colour.
struct LightRows {
  std::vector<BlendedLight> lights;
  UninitializedVector<LightWeight> weights; // by light, in order

  void clear() {
    lights.clear();
    weights.clear();
  }
  // Appends a captured light with its own colour.
  void add(uint32_t light, Rgb color) {
    const auto begin = static_cast<uint32_t>(weights.size());
    weights.push_back({light, 1});
    lights.push_back({color, begin, begin + 1});
  }
  // Weights of the row [begin, end).
  std::span<const LightWeight> weightsOf(size_t begin, size_t end) const {
    if (begin == end) return {};
    return {weights.data() + lights[begin].begin, weights.data() + lights[end - 1].end};
  }
};

// Operations that can be executed independently of others. The rows must outlive the part.
struct ShadingPart {
  std::span<const ShadingOp> ops;
  const LightRows* rows = nullptr;
  size_t targets = 0;
};

} // namespace surflect::shading
