// Patches of visible surfels whose weights of photographs are found at four corners, and are linear in
// between.
//
// Two corners are as far apart as any, the others on either side of the line between them: two triangles. A
// surfel has the barycentric coordinates of its projection into the triangle on its side; those below 0 count
// as 0, and the others are scaled to the sum 1.
//
// Weights change smoothly over a surface, but not where a cast shadow begins. Patches across such an edge are
// divided into groups of at most four surfels that are corners themselves.
#pragma once

#include "srf/weights/query.h"
#include "surfel/cloud.h"
#include "surfel/level_of_detail.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect::surfels {

// Groups of neighbouring visible surfels, in the order of their list. Indices are those of the list.
struct PatchCorners {
  std::vector<uint32_t> corners;                  // four of each group; small groups repeat one
  std::vector<uint32_t> firstPlace;               // of each group, then the length of the list
  std::vector<weights::AtCorners<float>> weights; // of the corners, at each visible surfel

  size_t groups() const { return corners.size() / 4; }
  // The surfels that are corners.
  std::vector<uint32_t> surfels(std::span<const uint32_t> visible) const;
  // Adds the places of the queries [begin, end), multiples of four, to a batch.
  void addPlaces(std::span<const uint32_t> visible, size_t begin, size_t end,
                 weights::QueryBatch& batch) const;
};

// Numbers of the groups of `now` that do not have the same places and corners in `before`.
std::vector<uint32_t> changedGroups(const PatchCorners& before, const PatchCorners& now);

// Corners of the given groups alone, ascending, over a list of their places only. `places` receives that
// list: indices into the whole one.
PatchCorners someGroups(const PatchCorners& all, std::span<const uint32_t> groups,
                        std::vector<uint32_t>& places);

// visible: surfels of a cloud, ascending. patches: of this cloud. reached: shadow states, `lights` of each
// visible surfel in succession; empty without any. The same bits for any number of threads.
PatchCorners patchCorners(const SurfelCloud& cloud, const Patches& patches, std::span<const uint32_t> visible,
                          std::span<const float> reached, size_t lights);

} // namespace surflect::surfels
