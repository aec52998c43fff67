// A lumigraph rendered plainly: one ray a pixel, in double precision. The frame on the GPU is tested against
// it.  [Azuma 1999, §4; Gortler 1996]
#pragma once

#include "render/lightfield/lumigraph/slab.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/geometry/ray_caster.h"

namespace surflect::lumigraph {

class Reference {
public:
  // The lumigraph must outlive this object.
  explicit Reference(const Lumigraph& lumigraph);

  // RGBA, premultiplied: radianceAt() where the ray through a pixel's centre first meets the geometry or,
  // failing that, the fringe. The camera is a pinhole. Throws Cancelled.
  image::Image render(const capture::Camera<AcquisitionSpace>& camera, const Progress& progress = {}) const;

private:
  const Lumigraph& lumigraph_;
  RayCaster<AcquisitionSpace> geometry_, fringe_;
};

} // namespace surflect::lumigraph
