// Interpolation between the samples of a triangle (patch_grid.h).
#pragma once

#include "render/lightfield/lfm/patch_grid.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace surflect::lfm {

// Place in the triangle whose corners start at the given one.
constexpr PatchPlace turned(int samplesPerEdge, PatchPlace place, size_t firstCorner) {
  const std::array<int, 3> steps{samplesPerEdge - 1 - place.i - place.j, place.i, place.j};
  return {steps[(firstCorner + 1) % 3], steps[(firstCorner + 2) % 3]};
}

// Linear interpolation between three neighbouring samples. On an edge of the triangle only the samples of the
// edge count.
struct PatchBlend {
  std::array<PatchPlace, 3> places;
  std::array<double, 3> weights;
};

// Blend at barycentrics b of corner 1 and c of corner 2, which are clamped to the triangle.
inline PatchBlend blendAt(int samplesPerEdge, double b, double c) {
  const int last = samplesPerEdge - 1;
  const double u = std::clamp(b, 0.0, 1.0) * last;
  const double v = std::clamp(c * last, 0.0, last - u);
  const int i = std::min(static_cast<int>(u), last - 1), j = std::min(static_cast<int>(v), last - 1 - i);
  const double x = u - i, y = v - j;
  // A cell at the edge between corners 1 and 2 has no half beyond it.
  if (x + y <= 1 || i + j == last - 1) return {{{{i, j}, {i + 1, j}, {i, j + 1}}}, {1 - x - y, x, y}};
  return {{{{i + 1, j + 1}, {i, j + 1}, {i + 1, j}}}, {x + y - 1, 1 - x, 1 - y}};
}

} // namespace surflect::lfm
