// Ways to weight photographs.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace surflect::ulr {

// How photographs are weighted for a surfel, a direction to the viewer and a light.
enum class Interpolation {
  paper,    // cameras and lights each by their own angle  [Weyrich 2005, §5.2]
  separate, // likewise, with the model's light blend, and surfels weighted by confidence
  pairs,    // ULR over pairs of cameras and lights, by the angles of both and of the half vector
  kriging,  // kriging over pairs (kriging.h)
};

constexpr std::string_view nameOf(Interpolation interpolation) {
  constexpr std::array<std::string_view, 4> kNames{"paper", "separate", "pairs", "kriging"};
  return kNames[static_cast<size_t>(interpolation)];
}

// How the photographs of a model are weighted, unless options say otherwise.
struct InterpolationChoice {
  Interpolation kind = Interpolation::separate;
  float halfScale = 0.2f;  // of half vectors under kriging (KrigingScales)
  bool reciprocal = false; // under kriging, photographs also answer for camera and light exchanged
  // For pairs and kriging: lit surfels are shown by photographs that were taken in light, shadowed surfels by
  // those taken in shadow. Wrong where light passes through the object.
  bool shadows = true;

  friend bool operator==(const InterpolationChoice&, const InterpolationChoice&) = default;
};

} // namespace surflect::ulr
