// A view as checks look at it: one photograph, and the silhouette of the mesh, at a size that is quickly
// read.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/mask.h"
#include "srf/query/ray_caster.h"
#include "surfel/progress.h"

#include <optional>
#include <vector>

namespace surflect {

struct SmallView {
  size_t view = 0, frame = 0;      // indices into the capture's
  Camera<AcquisitionSpace> camera; // with the small picture's lens
  Image radiance;                  // means over squares; of 3 channels
  std::optional<Mask> matte;       // of the photograph, where it has one
  Mask outline;                    // of the mesh

  // What shows the object, as far as it is known.
  const Mask& object() const { return matte ? *matte : outline; }
};

// Up to `most` views that have frames, evenly chosen, at no more than 512 pixels a side. Reads one photograph
// of each; progress names the stage "photographs".
std::vector<SmallView> smallViews(const Capture& capture, const RayCaster<AcquisitionSpace>& mesh,
                                  size_t most, const Progress& progress);

} // namespace surflect
