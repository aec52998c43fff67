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
// ends before a surfel that is too far from the run's first surfel, or whose normal differs from that
// surfel's by more than 45 degrees. Too far is beyond the width of a disc of `most` surfels, or 1/50 of the
// diagonal of the cloud's box. Cost: O(surfels).
Patches patchesOf(const SurfelCloud& cloud, size_t most);

} // namespace surflect
