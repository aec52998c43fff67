// Directions of a direction mesh whose textures a picture of a region can need.
#pragma once

#include "render/lightfield/slf/chart.h"
#include "render/lightfield/slf/direction_mesh.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>
#include <vector>

namespace surflect::slf {

// #directions: 1 if the direction is a corner of a triangle of the direction mesh, in which some direction is
// in front of some triangle of the region. The region shows only its back in the other directions, and is not
// drawn there.
std::vector<uint8_t> usedDirections(const TriangleMesh& mesh, const Chart& chart,
                                    const DirectionMesh& directions);

} // namespace surflect::slf
