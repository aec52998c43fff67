// Parametrization of a disc over the unit square, one to one: mean values inside, a bulged square around.
//
// With positive weights and a strictly convex border the map is one to one [Tutte 1963]. Of all vertices at
// the corners of the square, those give the least stretch [Sander 2001].
//
// [Tutte 1963] Tutte: How to Draw a Graph.
// [Floater 2003] Floater: Mean Value Coordinates.
// [Sander 2001] Sander, Snyder, Gortler, Hoppe: Texture Mapping Progressive Meshes, §3.
// Symbols: (s, t) coordinates of a vertex in the plane; S_s and S_t the derivatives of the surface point by
// them; a = S_s . S_s, c = S_t . S_t.
#pragma once

#include "render/lightfield/slf/disc.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace surflect::slf {

// Signed area of a triangle, positive if it is counter-clockwise.
inline double planeArea(const Vec2<double>& p1, const Vec2<double>& p2, const Vec2<double>& p3) {
  const Vec2<double> d = p2 - p1, e = p3 - p1;
  return (d.x() * e.y() - d.y() * e.x()) / 2;
}

// Integrals of a and c over the surface, and areas. a and c are infinite where a triangle has no positive
// area in the plane, even if it has none on the surface.
struct StretchSums {
  double a = 0, c = 0;
  double area = 0, planeArea = 0;

  // Integral of a / s^2 + c s^2 for the best s: the squared stretch of the rectangle of best aspect, for a
  // square of the plane's unit. Infinite if the map is not one to one.
  double leastStretch() const;
  // s^2 of the best s: width over height of the rectangle that replaces the square.
  double bestAspect() const;
};
StretchSums stretchSums(std::span<const Vec3<double>> positions,
                        std::span<const std::array<uint32_t, 3>> triangles,
                        std::span<const Vec2<double>> coordinates);

enum class MeanWeights {
  meanValue, // tan half-angles over lengths [Floater 2003, Eq. 2.1]: plane discs keep their shape
  uniform    // all the same [Tutte 1963]: does not depend on the shapes of triangles
};

// Map of a disc to a convex polygon: every interior vertex is a weighted mean of its neighbours. Factorised
// once; a border is mapped in the time of a back substitution.
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

struct Parametrization {
  std::vector<Vec2<double>> coordinates; // of each vertex, within the unit square
  StretchSums stretch;
};

// Maps a disc to a bulged square by mean values, with those vertices at the corners of the square that give
// the least stretch, which is that of the rectangle of the best aspect, StretchSums::leastStretch().
// `roughness` 0 is meant for good triangles; 1 and 2 trade stretch for room at vertices that rounding would
// let fall together. The map is one to one exactly if its stretch is finite.
Parametrization parametrizationOf(const Disc& disc, int roughness = 0);
inline constexpr int kRoughest = 2;

} // namespace surflect::slf
