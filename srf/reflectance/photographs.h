// Photographs of surfels, as tables are fitted to them: what each pixel shows of one surfel.
#pragma once

#include "srf/reflectance/table_coordinates.h"
#include "surfel/math/rgb.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::reflectance {

// Structure of arrays. The photographs of surfel s are [first[s], first[s + 1]) of the other spans.
// They are only those in which the surfel is seen and lit: neither hidden nor in shadow, both cosines > 0.
struct Photographs {
  std::span<const uint32_t> first;                                    // #surfels + 1
  std::span<const Direction3<SurfelSpace>> towardsView, towardsLight; // unit, in the surfel's frame
  // Coordinates of both directions in the frame of the tables, which is tilted and turned (tilts.h,
  // fibres.h).
  std::span<const HalfDifference<>> directions;
  std::span<const float> links;     // tableLink
  std::span<const Rgb> reflectance; // radiance over the irradiance of a surface facing the light

  size_t surfels() const { return first.size() - 1; }
  size_t size() const { return reflectance.size(); }
};

// Photographs with arrays of their own, tables' directions in the surfel's frame.
struct PhotographArrays {
  std::vector<uint32_t> first{0};
  std::vector<Direction3<SurfelSpace>> towardsView, towardsLight;
  std::vector<HalfDifference<>> directions;
  std::vector<float> links;
  std::vector<Rgb> reflectance;

  void add(const Direction3<SurfelSpace>& view, const Direction3<SurfelSpace>& light, const Rgb& value) {
    towardsView.push_back(view);
    towardsLight.push_back(light);
    directions.push_back(halfDifference(view, light));
    links.push_back(tableLink(light.z(), view.z()));
    reflectance.push_back(value);
  }
  void endSurfel() { first.push_back(static_cast<uint32_t>(reflectance.size())); }

  Photographs view() const { return {first, towardsView, towardsLight, directions, links, reflectance}; }
};

// Returns the photographs of the given surfels, surfel after surfel.
inline PhotographArrays subsetOf(const Photographs& photographs, std::span<const uint32_t> surfels) {
  PhotographArrays subset;
  for (const uint32_t surfel : surfels) {
    for (size_t i = photographs.first[surfel]; i < photographs.first[surfel + 1]; ++i)
      subset.add(photographs.towardsView[i], photographs.towardsLight[i], photographs.reflectance[i]);
    subset.endSurfel();
  }
  return subset;
}

// Surfels, evenly chosen, that have at most about `most` > 0 photographs together.
inline std::vector<uint32_t> thinnedSurfels(const Photographs& photographs, size_t most) {
  const size_t step = std::max<size_t>(1, (photographs.size() + most - 1) / most);
  std::vector<uint32_t> surfels;
  for (size_t surfel = 0; surfel < photographs.surfels(); surfel += step)
    surfels.push_back(static_cast<uint32_t>(surfel));
  return surfels;
}

} // namespace surflect::reflectance
