// Estimates the disk space, memory and time of packing a model, by timing on part of the surface and a few
// photographs.
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
  double seconds = 0; // for all of pack
};

// Estimates a model with surfels `spacing` apart (scene units). `frames` are indices into
// source.training().frames, by view; `secondsSoFar` is the time pack has taken already. Takes about a
// twentieth of the time of sampling, and reads four photographs. Throws Error and Cancelled.
PackEstimate estimatePack(const PackSource& source, std::span<const std::vector<size_t>> frames,
                          const TriangleMesh& surface, double spacing,
                          const RayCaster<AcquisitionSpace>& impostor, double secondsSoFar,
                          const Progress& progress);

} // namespace surflect::model
