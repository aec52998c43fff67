// Sample directions of one region, spent where its radiance bends over direction.
//
// Leaves out those directions of a fine mesh whose textures the hat functions of the kept directions
// reproduce. Error of a direction: root mean square, over texels observed in that direction and over
// channels, of the difference in radiance. Directions are added to the octahedron's six, always the one with
// the largest error, until no error exceeds the tolerance.
#pragma once

#include "render/lightfield/slf/direction_mesh.h"
#include "render/lightfield/slf/resample.h"
#include "render/lightfield/slf/texel_radiance.h"

#include <cstddef>
#include <vector>

namespace surflect::slf {

// Radiance of up to kJudgedTexels seen texels of a region, spread evenly, in each fine direction.
struct DirectionalRadiance {
  std::vector<std::vector<Vec3<float>>> radiance; // by direction, of each texel
  std::vector<std::vector<uint8_t>> isObserved;   // likewise: 1 if a photograph is near the direction
};
inline constexpr size_t kJudgedTexels = 256;

DirectionalRadiance directionalRadiance(const Observations& observations, const DirectionMesh& fine,
                                        Blend blend);

// Error of each fine direction if only `kept` (indices of fine directions) is stored; 0 for directions that
// are kept or not observed. `mesh` triangulates the kept directions, in their order.
std::vector<double> reproductionErrors(const DirectionalRadiance& radiance, const DirectionMesh& fine,
                                       const std::vector<size_t>& kept, const DirectionMesh& mesh);

// Indices of the fine directions to keep, in rising order. The first six of `fine` surround the sphere, as in
// octahedronDirections(). Tolerance in units of radiance.
std::vector<size_t> adaptedDirections(const DirectionalRadiance& radiance, const DirectionMesh& fine,
                                      double tolerance);

} // namespace surflect::slf
