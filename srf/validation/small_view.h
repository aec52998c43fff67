// A view as checks look at it: one photograph, and the silhouette of the mesh, at a size that is quickly
// read.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/mask.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/ray_caster.h"

#include <functional>
#include <optional>

namespace surflect::validation {

struct SmallView {
  size_t view = 0, frame = 0;               // indices into the capture's
  capture::Camera<AcquisitionSpace> camera; // with the small picture's lens
  image::Image radiance;                    // means over squares; of 3 channels
  std::optional<image::Mask> matte;         // of the photograph, where it has one
  image::Mask outline;                      // of the mesh

  // Pixels that show the object, as far as they are known.
  const image::Mask& object() const { return matte ? *matte : outline; }
};

// Calls look(view) for up to `most` views that have frames, evenly chosen, one after the other, at no more
// than 512 pixels a side. Reads one photograph of each: that whose light comes most from the camera's side,
// as seen from `middle`; progress names the stage "photographs".
void forEachSmallView(const capture::Capture& capture, const RayCaster<AcquisitionSpace>& mesh,
                      const Point3<AcquisitionSpace, double>& middle, size_t most, const Progress& progress,
                      const std::function<void(SmallView)>& look);

} // namespace surflect::validation
