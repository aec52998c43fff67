// Parametrization of a disc over the unit square, one to one, with little stretch.
#pragma once

#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/stretch.h"
#include "surfel/base/progress.h"
#include "surfel/math/space.h"

#include <vector>

namespace surflect::slf {

struct Parametrization {
  std::vector<Vec2<double>> coordinates; // of each vertex, within the unit square
  StretchSums stretch;
};

// Maps a disc to a bulged square by mean values, with those vertices at the corners of the square that give
// the least stretch; then all vertices move to lower it further, within the unit square. Stretch is that
// of the rectangle of the best aspect, StretchSums::leastStretch(). `roughness` 0 is meant for good
// triangles; 1 to 3 trade stretch for room at vertices that rounding would let fall together. The map is one
// to one exactly if its stretch is finite. `texels` is the number of texels that the map is meant for: gaps
// in the border are not narrower than two of them (border_gaps.h). Throws Cancelled.
Parametrization parametrizationOf(const Disc& disc, double texels, int roughness = 0,
                                  const Progress& progress = {});
inline constexpr int kRoughest = 3;

} // namespace surflect::slf
