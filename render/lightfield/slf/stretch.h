// Stretch of a map from a disc of the mesh to the plane.
//
// [Sander 2001] Sander, Snyder, Gortler, Hoppe: Texture Mapping Progressive Meshes, §3.
// Symbols: q corners of a triangle on the surface; (s, t) their coordinates in the plane; S_s and S_t the
// derivatives of the surface point by them; a = S_s . S_s, b = S_s . S_t, c = S_t . S_t.
#pragma once

#include "render/lightfield/slf/plane_border.h"
#include "surfel/math/space.h"

#include <array>
#include <cstdint>
#include <span>

namespace surflect::slf {

using Coordinates = std::span<const Vec2<double>>; // (s, t) of each vertex

// First fundamental form of the surface over the plane within a triangle.
struct Metric {
  double a = 0, b = 0, c = 0;

  // Largest length on the surface of a unit length in the plane: the larger singular value.
  double largest() const; // [Sander 2001, Gamma]
  // Mean square of that length over all directions.
  double meanSquare() const { return (a + c) / 2; } // [Sander 2001, L2 of a triangle, squared]
};
Metric metricOf(const std::array<Vec3<double>, 3>& q, const std::array<Vec2<double>, 3>& p);

// Integrals of a and c over the surface, and areas. a and c are infinite where a triangle has no positive
// area in the plane, even if it has none on the surface.
struct StretchSums {
  double a = 0, c = 0;
  double area = 0, planeArea = 0;

  // Integral of a / s^2 + c s^2 for the best s: the squared stretch of the rectangle of best aspect, for a
  // square of the plane's unit. Infinite if the map is not one to one.
  double leastStretch() const;
  // // s^2 of the best s: width over height of the rectangle that replaces the square.
  double bestAspect() const;
};
StretchSums stretchSums(std::span<const Vec3<double>> positions,
                        std::span<const std::array<uint32_t, 3>> triangles, Coordinates coordinates);

} // namespace surflect::slf
