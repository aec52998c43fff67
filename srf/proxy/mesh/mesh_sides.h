// Which sides of a mesh cameras see.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/geometry/mesh_topology.h"

#include <span>

namespace surflect::proxy {

// Area of a part's triangles that cameras see from the front, and from the back, counted once for each
// camera: as they are wound, and as they would be if all were wound as most of the part, by area, is.
struct SeenSides {
  double front = 0, back = 0;
  double frontAlike = 0, backAlike = 0;
};

// For each part, by rays from the middles of up to 16384 triangles, four of a part at least, to up to 32
// cameras, evenly chosen, or to all cameras where `asksAll` (#parts). Triangles seen at an angle of less than
// 6 degrees, or beside the picture, tell nothing.
std::vector<SeenSides> seenSides(const TriangleMesh& mesh, const MeshParts& parts,
                                 const std::vector<bool>& asksAll,
                                 std::span<const capture::Camera<AcquisitionSpace>> cameras,
                                 const Progress& progress);

} // namespace surflect::proxy
