// Work of a frame in visibility order.
#pragma once

#include <cstddef>

namespace surflect::olf {

struct FrameCounts {
  size_t passes = 0;    // that draw the mesh
  size_t fragments = 0; // in the lists, or of all layers; not counted for the BSP tree
  size_t layers = 0;    // of depth peeling
};

} // namespace surflect::olf
