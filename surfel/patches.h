// Patches: small pieces of a cloud whose surfels have nearly the same directions to cameras and lights.
#pragma once

#include "surfel/cloud.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect {

// Runs of neighbouring surfels of one sheet.
struct Patches {
  std::vector<uint32_t> first;  // first surfel of each patch, then the number of surfels
  std::vector<uint32_t> middle; // of each patch: the surfel nearest to the mean of its positions

  size_t size() const { return middle.size(); }
};

// Cuts a cloud that is sorted along a space-filling curve into runs of at most `most` > 0 surfels. A run also
// ends before a surfel too far from the run's first one: farther than a disc of `most` surfels is wide, or
// than 1/50 of the diagonal of the cloud's box; and before a surfel whose normal differs by more than 45
// degrees. Cost: O(surfels).
Patches patchesOf(const SurfelCloud& cloud, size_t most);

} // namespace surflect
