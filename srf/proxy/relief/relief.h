// Meshes for an object that one camera saw. They cover the pixels of its mask and face the camera.
#pragma once

#include "srf/proxy/relief/integrate.h"
#include "surfel/geometry/mesh.h"

namespace surflect::relief {

// One quad per pixel, by the rays through its corners, at the depths of the map. The surface of connected
// pixels is continuous, also at depth steps. The outline is smooth, within half a pixel of the mask's.
TriangleMesh reliefMesh(const capture::Camera<AcquisitionSpace>& camera, const DepthMap& map);

// Flat mesh: the part of the frontal plane that the mask shows, exactly, with few quads.
TriangleMesh planeMesh(const capture::Camera<AcquisitionSpace>& camera, const image::Mask& mask);

} // namespace surflect::relief
