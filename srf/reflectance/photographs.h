// Photographs of surfels, as tables are fitted to them: what each pixel shows of one surfel.
#pragma once

#include "srf/reflectance/table_coordinates.h"
#include "surfel/math/rgb.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace surflect::reflectance {

// Structure of arrays. The photographs of surfel s are [first[s], first[s + 1]) of the other spans. Only
// those in which the surfel is seen and lit: neither hidden from the camera nor in shadow, both cosines > 0.
struct Photographs {
  std::span<const uint32_t> first;              // #surfels + 1
  std::span<const HalfDifference<>> directions; // in the surfel's frame
  std::span<const float> links;                 // tableLink
  std::span<const Rgb> reflectance;             // radiance over the irradiance of a surface facing the light

  size_t surfels() const { return first.size() - 1; }
  size_t size() const { return reflectance.size(); }
};

} // namespace surflect::reflectance
