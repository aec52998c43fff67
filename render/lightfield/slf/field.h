// Surface light field: for each texture region a chart, a direction mesh, and a texture for each of its
// directions.
//
// [Azuma 1999] Azuma: Interactive Rendering of Surface Light Fields.
// F(r) = sum_i B_i(r) F_i: the texture of a region seen from direction r, where F_i is the texture of sample
// direction r_i, and B_i its hat function.  [Azuma 1999, §2.2]
#pragma once

#include "render/lightfield/slf/chart.h"
#include "render/lightfield/slf/direction_mesh.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace surflect::slf {

struct Region {
  Chart chart;
  uint32_t directionMesh = 0; // index into Field::directionMeshes
};

struct Field {
  TriangleMesh mesh; // each triangle is in exactly one region
  std::vector<Region> regions;
  std::vector<DirectionMesh> directionMeshes;

  const DirectionMesh& directionsOf(size_t region) const {
    return directionMeshes[regions[region].directionMesh];
  }
  // Number of textures, and of passes without any culling: the sum of directions over regions.
  size_t textures() const {
    size_t sum = 0;
    for (size_t region = 0; region < regions.size(); ++region)
      sum += directionsOf(region).directions().size();
    return sum;
  }
};

// Texel: half floats r, g, b of linear radiance, and how far it was observed: 1 if photographs saw that place
// from about that direction, 0 if it was filled in. All are finite.
using Texel = std::array<uint16_t, 4>;

// Textures of a field, by region and direction.
class Textures {
public:
  virtual ~Textures() = default;
  // Texels of F_i of a region: rows of the chart's width, row 0 first. May be called from several threads.
  // Throws Error where a file cannot be read.
  virtual std::vector<Texel> read(size_t region, size_t direction) const = 0;
};

} // namespace surflect::slf
