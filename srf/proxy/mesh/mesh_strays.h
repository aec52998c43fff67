// Triangles that lie far off and that nobody would miss: specks and spikes that reconstruction leaves behind.
// They would set the scale of all that is measured by the mesh's box.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/geometry/mesh_topology.h"

#include <span>

namespace surflect::proxy {

struct Spikes {
  std::vector<uint32_t> triangles; // in rising order
  Vec3<double> farthest = Vec3<double>::Zero();
  bool areSeen = false; // they take more than a tenth of what cameras see of the mesh: nobody's mistake
};

// Triangles with a corner farther from the box of most vertices (98 % along each axis) than ten times its
// diagonal.
Spikes spikesIn(const TriangleMesh& mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras,
                const Progress& progress);

// Parts farther from the box of the largest parts, which have 99 % of the area, than its diagonal, and in the
// pictures of fewer than half of the cameras. Indices of parts, in rising order.
std::vector<size_t> specksAmong(const std::vector<MeshParts::Part>& parts,
                                std::span<const capture::Camera<AcquisitionSpace>> cameras);

} // namespace surflect::proxy
