// Light rows: captured lights with their weights, by which the photographs of one camera are blended.
#pragma once

#include "surfel/base/uninitialized_vector.h"
#include "surfel/math/rgb.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::weights {

// Weight of a captured light, given by its column.
struct LightWeight {
  uint32_t light;
  float weight;
};

// Colour of a light, and the captured lights blended for it: a range of weights.
struct BlendedLight {
  Rgb color;
  uint32_t begin = 0, end = 0;
};

// Light rows of surfels: a row is a range of `lights`. Captured lights are blended before they are coloured:
// n captured lights cost n + 3 products for each term of a block, and would cost 4 n if each had its own
// colour.
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

} // namespace surflect::weights
