// Patches of visible surfels whose weights of photographs are found at four corners, and are linear in
// between.
//
//   b_k(x) = 1/4 + (c_k - m)^T (C + 1e-3 tr(C) I)^-1 (x - m),   C = sum_k (c_k - m)(c_k - m)^T
//
// Symbols: c_k places of the corners, m their mean, x place of a surfel; b_k its weight of corner k, by
// linear regression over the corners [Galton 1886]; those below 0 count as 0, and the others are scaled to
// the sum 1.
//
// Weights change smoothly over a surface, but not where a cast shadow begins. Patches across such an edge are
// divided into groups of at most four surfels that are corners themselves.
//
// [Galton 1886] Galton: Regression towards Mediocrity in Hereditary Stature, J. Anthropological Institute 15.
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
  std::vector<uint32_t> corners;                  // four of each group, some perhaps the same
  std::vector<uint32_t> firstPlace;               // of each group, then the length of the list
  std::vector<weights::AtCorners<float>> weights; // b of each visible surfel

  // The surfels that are corners.
  std::vector<uint32_t> surfels(std::span<const uint32_t> visible) const;
  // Adds the places of the queries [begin, end), multiples of four, to a batch.
  void addPlaces(std::span<const uint32_t> visible, size_t begin, size_t end,
                 weights::QueryBatch& batch) const;
};

// visible: surfels of a cloud, ascending. patches: of this cloud. reached: shadow states, `lights` of each
// visible surfel in succession; empty without any. The same bits for any number of threads.
PatchCorners patchCorners(const SurfelCloud& cloud, const Patches& patches, std::span<const uint32_t> visible,
                          std::span<const float> reached, size_t lights);

} // namespace surflect::surfels
