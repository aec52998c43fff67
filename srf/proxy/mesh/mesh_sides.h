// Sides of a mesh, front or back, that cameras see.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/geometry/mesh_topology.h"

#include <span>

namespace surflect::proxy {

// Area of a part's triangles that cameras see from the front, and from the back, counted once for each
// camera. `front` and `back` are for triangles as they are wound; `frontAlike` and `backAlike` for triangles
// all wound like the majority of the part, by area.
struct SeenSides {
  double front = 0, back = 0;
  double frontAlike = 0, backAlike = 0;
};

// Returns the seen sides of each part, estimated by rays from the middles of at most 16384 triangles, but at
// least four per part. Rays go to at most 32 evenly chosen cameras, or to all cameras for parts with
// `asksAll` (#parts). Triangles outside of the picture, or seen at an angle of less than 6 degrees, are
// ignored.
std::vector<SeenSides> seenSides(const TriangleMesh& mesh, const MeshParts& parts,
                                 const std::vector<bool>& asksAll,
                                 std::span<const capture::Camera<AcquisitionSpace>> cameras,
                                 const Progress& progress);

} // namespace surflect::proxy
