// Border of a disc laid along a slightly bulged unit square.
#pragma once

#include "render/lightfield/slf/disc.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <vector>

namespace surflect::slf {

// Indices into Disc::border of the vertices at the corners of the square, in rising order. After a rotation
// of the four they are lower left, lower right, upper right and upper left.
using SquareCorners = std::array<size_t, 4>;

struct SquareShape {
  // Distance by which the middles of the sides stand out beyond the corners; the middles touch 0 and 1. At
  // 1/6 the sides would meet without a corner.
  double bulge = 0.02;
  double evenness = 0; // 0 spaces vertices along a side by their distances, 1 evenly
};

// Coordinates of each border vertex, strictly convex and counter-clockwise. Needs at least 4 vertices, and a
// bulge above 0 and below 1/6.
std::vector<Vec2<double>> squareBorder(const Disc& disc, const SquareCorners& corners,
                                       const SquareShape& shape = {});

} // namespace surflect::slf
