// Geometry for an object that one camera saw: what stands in for it covers the pixels of its mask and faces
// the camera.
#pragma once

#include "srf/proxy/relief/integrate.h"
#include "surfel/geometry/mesh.h"

namespace surflect::relief {

// A quad per pixel (of rays through its corners) at the depths of the map. Connected pixels make a connected
// surface: it is not torn at steps. The outline is smooth, within half a pixel of the mask's.
TriangleMesh reliefMesh(const capture::Camera<AcquisitionSpace>& camera, const DepthMap& map);

// The same, flat: the part of the frontal plane that the mask shows, exactly, in as few quads as is easy.
TriangleMesh planeMesh(const capture::Camera<AcquisitionSpace>& camera, const image::Mask& mask);

} // namespace surflect::relief
