// Size of a photograph's pixel on the surface.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/geometry/mesh.h"

#include <span>

namespace surflect::lightfield {

// Median of the width of a pixel at the distance of the surface, in scene units, over points spread evenly by
// area and the cameras that they face and that they project into. Zero if there are none.
double pixelFootprint(const TriangleMesh& mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras);

} // namespace surflect::lightfield
