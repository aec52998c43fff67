// Light on surfels, as photographs under captured lights are blended for it.
#pragma once

#include "srf/codec/blended_light.h"
#include "surfel/base/uninitialized_vector.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::codec {

// A row is a part of the lights: all that shines on a surfel, or on one for a view. Captured lights are
// blended before they are coloured: n of them cost n + 3 products for each term of a block, where n with
// colours of their own cost 4 n.
struct LightRows {
  std::vector<BlendedLight> lights;
  UninitializedVector<LightWeight> weights; // of the first light, of the second, and so on

  void clear() {
    lights.clear();
    weights.clear();
  }
  // A captured light in a colour of its own.
  void add(uint32_t light, Rgb color) {
    const auto begin = static_cast<uint32_t>(weights.size());
    weights.push_back({light, 1});
    lights.push_back({color, begin, begin + 1});
  }
  // Of the row [begin, end) of lights.
  std::span<const LightWeight> weightsOf(size_t begin, size_t end) const {
    if (begin == end) return {};
    return {weights.data() + lights[begin].begin, weights.data() + lights[end - 1].end};
  }
};

} // namespace surflect::codec
