// Maps of a disc to a convex polygon: every interior vertex is a weighted mean of its neighbours.
//
// With positive weights and a strictly convex border the map is one to one [Tutte 1963].
//
// [Tutte 1963] Tutte: How to Draw a Graph.
// [Floater 2003] Floater: Mean Value Coordinates.
#pragma once

#include "render/lightfield/slf/disc.h"
#include "surfel/math/space.h"

#include <memory>
#include <span>
#include <vector>

namespace surflect::slf {

enum class MeanWeights {
  meanValue, // tan half-angles over lengths [Floater 2003, Eq. 2.1]: plane discs keep their shape
  uniform    // all the same [Tutte 1963]: does not depend on the shapes of triangles
};

// Factorised once; a border is mapped in the time of a back substitution.
class ConvexMap {
public:
  ConvexMap(const Disc& disc, MeanWeights weights);
  ~ConvexMap();
  ConvexMap(ConvexMap&&) noexcept;

  // Coordinates of all vertices, given those of the border in its order. NaN if the weights were too uneven
  // for the solver.
  std::vector<Vec2<double>> operator()(std::span<const Vec2<double>> border) const;

private:
  struct System;
  std::unique_ptr<const System> system_;
};

} // namespace surflect::slf
