// Radiance for texels that no photograph sees, across the borders of regions.
//
// Regions share points along their borders. A point has a radiance in each base direction: the mean of the
// regions that were seen there, by their share of seen texels. Radiance that no photograph shows from near a
// direction counts only where there is none that one shows. Texels at a point that were not seen have the
// point's radiance; those between are filled from all of these and from seen texels by pull-push. Points that
// no region saw have the mean of the regions beside them, once these are filled, so that both sides agree.
#pragma once

#include "render/lightfield/slf/field.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace surflect::slf {

// A point of the surface on a chart's border.
struct BorderPoint {
  uint32_t point = 0;          // number; other charts that meet there have the same
  Vec2<double> place = {0, 0}; // in the chart's textures, texels
};

struct BorderPoints {
  std::vector<std::vector<BorderPoint>> ofChart;
  size_t count = 0;
};

// Vertices on the borders of charts, and points of their edges about `spacing` apart (> 0, scene units; at
// most 2^15 of an edge).
BorderPoints borderPoints(const TriangleMesh& mesh, std::span<const Chart> charts, double spacing);

// Radiance of a region as photographs showed it.
struct SeenRegion {
  std::vector<uint8_t> isUsed; // by direction of the region: whether it has a texture
  std::vector<bool> isSeen;    // #texels: whether a photograph sees it

  bool isUnseen() const;
};

// Textures of regions while they are filled.
struct TextureStore {
  std::function<std::vector<Texel>(size_t region, size_t direction)> read; // of regions that are not unseen
  std::function<void(size_t region, size_t direction, std::span<const Texel> texels)> write;
};

// Writes the textures of all regions with unseen texels on their border. The directions of each region are
// some of the base's, in their order. Returns for each region whether it is black: unseen, and not connected
// to a seen one; it is not written. Memory: 16 bytes for each base direction of each border point with unseen
// texels. Does not depend on the number of threads. Throws Error as the store does,
// and Cancelled.
std::vector<uint8_t> fillUnseenTexels(const Field& field, std::span<const SeenRegion> seen,
                                      const DirectionMesh& base, const BorderPoints& borders,
                                      const TextureStore& store, const Progress& progress = {});

} // namespace surflect::slf
