// Geometry for a capture with one camera and no mesh.
#pragma once

#include "srf/capture/capture.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

namespace surflect::proxy {

// Returns the part of the frontal plane (frontal_plane.h) that mattes show or, without mattes, that the
// picture shows. If `asRelief`, the surface follows the normals found by photometric stereo (photometric.h).
// Throws Error, also if the lights do not determine normals, and Cancelled.
TriangleMesh meshOfOneView(const capture::Capture& training, bool asRelief, const Progress& progress);

} // namespace surflect::proxy
