// Silhouettes of meshes in cameras.
#pragma once

#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/geometry/ray_caster.h"

namespace surflect::capture {

// The mesh as a camera sees it, one channel: 1 where the ray through the pixel's centre meets it, else 0.
template <class Space> image::Image silhouette(const Camera<Space>& camera, const RayCaster<Space>& mesh);

extern template image::Image silhouette(const Camera<AcquisitionSpace>&, const RayCaster<AcquisitionSpace>&);
extern template image::Image silhouette(const Camera<ObjectSpace>&, const RayCaster<ObjectSpace>&);

} // namespace surflect::capture
