// Size of a photograph's pixel on the surface.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/geometry/mesh.h"

#include <span>

namespace surflect::lightfield {

// Median width of a pixel at the surface, in scene units: over points spread evenly by area, and for each
// point over the cameras that it faces and projects into. Zero if no camera sees a point.
double pixelFootprint(const TriangleMesh& mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras);

} // namespace surflect::lightfield
