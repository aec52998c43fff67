// Which pencils show a direction, and with which weights: continuous levels of detail, and interpolation
// between neighbouring pencils.
//
// [Domingo 2007, §3.2, Fig. 3]: between levels n and n + 1, pencils of level n count 1 - f and their children
// f. Weights of a direction sum to 1.
//
// Interpolation (which the paper leaves as future work) is linear: a pencil weighs 1 at its middle, 1/2 at
// the middles of its sides, 1/n at a corner where n pencils meet, and 0 at the middles of all others. Each
// pencil is cut for this into six triangles (middle, corner, middle of a side).
#pragma once

#include "render/lightfield/spherical/direction_tree.h"

#include <array>
#include <cstddef>
#include <vector>

namespace surflect::spherical {

// Level and weight of the one or two levels that a continuous level of detail 0..levels-1 blends.
struct LevelShare {
  size_t level = 0;
  double weight = 1;
};
std::vector<LevelShare> levelShares(double detail, size_t levels);

struct PencilShare {
  Pencil pencil;
  double weight = 1;
};
// Pencils of a level that show a direction: one, or several if they are interpolated.
std::vector<PencilShare> pencilShares(const DirectionTree& tree, size_t level, const Vec3<double>& direction,
                                      bool interpolated);

// Part of a pencil in which a pencil, itself or a neighbour, has weights that are linear between the corners:
// the weight of a direction sum_i x_i corner_i is sum_i x_i weight_i / sum_i x_i.
struct WeightedTriangle {
  Pencil pencil;
  Corners corners;
  std::array<double, 3> weights;
};
// Appends the triangles that show the directions of a pencil, with weights times `weight`.
void appendTriangles(const DirectionTree& tree, const Pencil& pencil, double weight, bool interpolated,
                     std::vector<WeightedTriangle>& triangles);

} // namespace surflect::spherical
