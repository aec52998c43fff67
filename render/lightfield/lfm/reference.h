// Light field maps by rays, in double precision.
#pragma once

#include "render/lightfield/lfm/maps.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <optional>

namespace surflect::lfm {

class Reference {
public:
  // Throws Error where the mesh does not fit into memory, and Cancelled.
  explicit Reference(LightFieldMaps maps, const Progress& progress = {});

  // RGBA, premultiplied: radianceAt() where the ray through a pixel's middle meets the front of the surface,
  // with alpha 1; 0 elsewhere. All kinds of lenses. Throws Cancelled.
  image::Image render(const capture::Camera<AcquisitionSpace>& camera, std::optional<size_t> terms = {},
                      const Progress& progress = {}) const;

private:
  LightFieldMaps maps_; // of coding `bytes`
  RayCaster<AcquisitionSpace> rays_;
};

} // namespace surflect::lfm
