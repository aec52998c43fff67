// Geometry for a capture with one camera and no mesh.
#pragma once

#include "srf/capture/capture.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

namespace surflect::proxy {

// The part of the plane through the world's origin, facing the camera, that mattes show; without mattes, that
// the picture shows. As a relief, bent to the normals that the lights tell: see photometric.h. Throws Error,
// also where lights do not tell normals, and Cancelled.
TriangleMesh meshOfOneView(const capture::Capture& training, bool asRelief, const Progress& progress);

} // namespace surflect::proxy
