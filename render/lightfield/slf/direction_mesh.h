// Direction mesh: sample directions triangulated on the unit sphere, with a hat function at each.
//
// [Azuma 1999, §2.2] Azuma: Interactive Rendering of Surface Light Fields.
// Symbols: r a direction from the surface towards the viewer; r_i sample directions; B_i their hat functions.
#pragma once

#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::slf {

using Direction = Direction3<AcquisitionSpace, double>;

// The three hat functions that are not 0 at a direction. Weights are not negative and sum to 1.
struct HatWeights {
  uint32_t triangle = 0;
  std::array<uint32_t, 3> directions = {};
  std::array<double, 3> weights = {};
};

class DirectionMesh {
public:
  // Triangulates unit directions by their convex hull, which is their Delaunay triangulation on the sphere.
  // Throws Error unless the directions are finite, distinct and in no closed hemisphere.
  explicit DirectionMesh(std::vector<Direction> directions);
  // Takes triangles as they were stored: of four directions in one plane, the hull leaves the diagonal open.
  // Throws Error unless the directions are finite and distinct and the triangles' cones cover the sphere
  // once.
  DirectionMesh(std::vector<Direction> directions, std::vector<std::array<uint32_t, 3>> triangles);

  std::span<const Direction> directions() const { return directions_; }
  // Corners are indices of directions, counter-clockwise seen from outside.
  std::span<const std::array<uint32_t, 3>> triangles() const { return triangles_; }
  // Triangle across the edge opposite to each corner.
  const std::array<uint32_t, 3>& neighbors(size_t triangle) const { return neighbors_[triangle]; }

  // Triangle whose cone holds r, by a walk from `start`.
  uint32_t triangleAt(const Direction& r, uint32_t start = 0) const;
  // B_i(r) for all i that are not 0: barycentric coordinates of the point where the ray along r meets the
  // flat triangle.
  HatWeights weightsAt(const Direction& r, uint32_t start = 0) const;

private:
  std::vector<Direction> directions_;
  std::vector<std::array<uint32_t, 3>> triangles_, neighbors_;
};

// Vertices of an octahedron whose faces are subdivided into four, `subdivisions` times: 6, 18, 66, 258, ...
// [Azuma 1999, §3] has 66.
std::vector<Direction> octahedronDirections(int subdivisions);

} // namespace surflect::slf
