// Queries for patches of surfels that share the weights of cameras and lights.
#pragma once

#include "render/surfels/cut.h"
#include "srf/weights/query.h"
#include "surfel/cloud.h"
#include "surfel/patches.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::surfels {

// Queries for the patches that have a visible surfel. Indices of surfels are those of the drawn cloud.
struct PatchQueries {
  std::vector<uint32_t> surfels;    // one per query: the patch's middle, or a visible surfel if that is dead
  std::vector<uint32_t> firstPlace; // of each query in the list of visible surfels, then its length
};

// visible: surfels of the drawn cloud, ascending. patches: of the drawn cloud.
PatchQueries patchQueries(const Patches& patches, std::span<const uint32_t> visible,
                          const DeformedCloud& deformed);

// Adds the places of the queries [begin, end) to a batch.
void addPlaces(const PatchQueries& queries, std::span<const uint32_t> visible, size_t begin, size_t end,
               weights::QueryBatch& batch);

// Patches of a cut: what the cut has left of each patch of the whole cloud. The middle of a patch is the
// middle surfel of its run.
Patches patchesIn(const Cut& cut, const Patches& whole);

} // namespace surflect::surfels
