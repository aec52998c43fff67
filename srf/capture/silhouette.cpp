#include "srf/capture/silhouette.h"

#include <tbb/parallel_for.h>

namespace surflect::capture {

template <class Space> image::Image silhouette(const Camera<Space>& camera, const RayCaster<Space>& mesh) {
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  image::Image mask(camera.lens.width, camera.lens.height, 1);
  tbb::parallel_for(0, mask.height, [&](int y) {
    for (int x = 0; x < mask.width; ++x)
      if (const auto ray = rayThrough(camera.lens, {x + 0.5, y + 0.5}))
        mask.at(x, y)[0] =
            mesh.firstHit(worldFromCamera(ray->origin), worldFromCamera(ray->direction)) ? 1.f : 0.f;
  });
  return mask;
}

template image::Image silhouette(const Camera<AcquisitionSpace>&, const RayCaster<AcquisitionSpace>&);
template image::Image silhouette(const Camera<ObjectSpace>&, const RayCaster<ObjectSpace>&);

} // namespace surflect::capture
