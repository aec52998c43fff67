// Light on surfels, as photographs under captured lights are blended for it.
#pragma once

#include "surfel/rgb.h"
#include "surfel/unset.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

// A captured light, by its column, and how much of it.
struct LightWeight {
  uint32_t light;
  float weight;
};

// Light of one colour, and the captured lights that answer for it: weights [begin, end).
struct BlendedLight {
  Rgb color;
  uint32_t begin = 0, end = 0;

  size_t size() const { return end - begin; }
};

// A row is a part of the lights: all that shines on a surfel, or on one for a view. Weights are real numbers,
// and colours are multiplied once for all that are blended: where captured lights share a colour, a third of
// the products of a row with a colour for each weight.
struct LightRows {
  std::vector<BlendedLight> lights;
  UnsetVector<LightWeight> weights; // of the first light, of the second, and so on

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

} // namespace surflect
