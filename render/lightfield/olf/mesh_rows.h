// Options that builders of opacity light fields share: the coarse mesh, and the views that count for its
// vertices.
#pragma once

#include "render/lightfield/olf/visible_views.h"
#include "render/method/rows.h"

#include <cstddef>
#include <optional>

namespace surflect::olf {

struct MeshOptions {
  bool hull = false;               // an opacity hull, even if the capture has a mesh
  std::optional<size_t> triangles; // of the mesh, at most; none: as it is
  std::optional<Visible> visible;  // none: all for an opacity hull, ring for another mesh
};

// Rows of the member `mesh` of a builder's options.
template <class Struct> method::Rows<Struct> meshRows() {
  return {
      method::row<Struct>("hull", [](auto& o) -> auto& { return o.mesh.hull; },
                          {.help = "an opacity hull from the views' alpha, instead of the capture's mesh"}),
      method::row<Struct>("triangles", [](auto& o) -> auto& { return o.mesh.triangles; },
                          {.domain = method::wholeRange(4, 2147483648),
                           .help = "simplify to so many triangles that enclose the mesh; default: as it is"}),
      method::row<Struct>(
          "visible", [](auto& o) -> auto& { return o.mesh.visible; },
          {.domain = method::words({"ring", "all"}),
           .help = "views of a vertex: those that see all triangles around it (ring), or all, hidden or not; "
                   "default: all for an opacity hull, ring for a mesh"})};
}

} // namespace surflect::olf
