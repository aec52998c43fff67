// Greedy merging of triangles into regions that are discs.
#pragma once

#include "render/lightfield/slf/region_moments.h"
#include "render/lightfield/slf/regions.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::slf {

// Border of the union of two discs, given their borders: counter-clockwise loops of places. Empty unless the
// union is a disc: the loops share one path of `sharedEdges` edges and no other place, no place within the
// path is pinched, and what is left has at least three edges. `order` is scratch memory, #places of 0.
std::vector<uint32_t> unitedLoop(std::span<const uint32_t> a, std::span<const uint32_t> b, size_t sharedEdges,
                                 std::span<const uint8_t> isPinched, std::span<uint32_t> order);

// Moments of each triangle about a point near the mesh, its first position.
std::vector<RegionMoments> triangleMoments(const TriangleMesh& mesh);

// #triangles: a number for each region, by merging the neighbours of least cost until `options.regions` are
// left or no union is a disc within the cone.
std::vector<uint32_t> mergedRegions(const TriangleMesh& mesh, const TriangleGraph& graph,
                                    std::span<const RegionMoments> moments, const RegionOptions& options,
                                    const Progress& progress = {});

} // namespace surflect::slf
