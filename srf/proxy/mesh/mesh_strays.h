// Stray triangles far from the object: specks and spikes that reconstruction leaves behind. They would
// enlarge the mesh's box, to which other lengths are scaled.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/geometry/mesh_topology.h"

#include <span>

namespace surflect::proxy {

struct Spikes {
  std::vector<uint32_t> triangles; // in rising order
  Vec3<double> farthest = Vec3<double>::Zero();
  bool areSeen = false; // true if they cover over a tenth of the mesh in the pictures: part of the object
};

// Triangles with a corner farther from the box of most vertices (98 % along each axis) than ten times its
// diagonal.
Spikes spikesIn(const TriangleMesh& mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras,
                const Progress& progress);

// Returns the indices of specks, in rising order. The body is the largest parts that together have 99 % of
// the area. A speck is any other part that is farther from the body's box than the box's diagonal, and whose
// middle is in the picture of fewer than half of the cameras.
std::vector<size_t> specksAmong(const std::vector<MeshParts::Part>& parts,
                                std::span<const capture::Camera<AcquisitionSpace>> cameras);

} // namespace surflect::proxy
