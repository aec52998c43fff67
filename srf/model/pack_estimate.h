// Estimate of what a model will take, before the work: from a part of the surface that is sampled, and some
// photographs that are read, as long as they take on this machine as it is now.
#pragma once

#include "srf/model/pack_source.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/ray_caster.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::model {

struct PackEstimate {
  size_t surfels = 0;
  uint64_t diskBytes = 0, memoryBytes = 0;
  double seconds = 0; // of all of pack
};

// For surfels `spacing` apart on the surface. `frames` of each view, as indices into
// source.training().frames; `secondsSoFar` is what pack took until now. Cost: about a twentieth of sampling,
// and the reading of four photographs. Throws Error and Cancelled.
PackEstimate estimatePack(const PackSource& source, std::span<const std::vector<size_t>> frames,
                          const TriangleMesh& surface, double spacing,
                          const RayCaster<AcquisitionSpace>& impostor, double secondsSoFar,
                          const Progress& progress);

} // namespace surflect::model
