// The views that see each vertex of a mesh.  [Vlasic 2003, §3]
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/rings.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::olf {

// The views that count for a vertex.
enum class Visible {
  ring, // those in which its whole ring of triangles faces the viewer and is unoccluded, as in the paper
  all   // all whose pictures hold the ring, as the paper proposes for objects that hide little of themselves
};

struct VisibleViews {
  std::vector<uint32_t> first; // #positions + 1
  std::vector<uint32_t> views; // of each vertex, in rising order
  size_t unseenVertices = 0;   // which no view sees: they have the views that face them, or else all

  std::span<const uint32_t> of(uint32_t vertex) const {
    return std::span(views).subspan(first[vertex], first[vertex + 1] - first[vertex]);
  }
};

// Visible views of each vertex of the rings, as indices of `training`. A triangle counts as unoccluded if
// rays from seven of its points are: near the corners, near the middles of the edges, and its centroid.
// Equal for any number of threads. Throws Cancelled.
VisibleViews visibleViews(const lightfield::Views& views, std::span<const size_t> training,
                          const lfm::Rings& rings, Visible rule, const Progress& progress = {});

} // namespace surflect::olf
