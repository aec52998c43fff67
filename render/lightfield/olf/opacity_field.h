// An opacity light field: a mesh, views with alpha, and which of them see each vertex.
//
// [Vlasic 2003] Vlasic et al.: Opacity Light Fields, I3D.
#pragma once

#include "render/lightfield/olf/view_triangulation.h"
#include "render/method/rows.h"
#include "srf/capture/camera.h"
#include "surfel/geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::olf {

// Options that builders of opacity light fields share: the coarse mesh, and the views that count for its
// vertices.
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

// How the closest views of a vertex are found and weighted.
enum class Blending {
  vdtm, // view-dependent texture mapping: triangulated directions [Vlasic 2003, §4]
  ulr   // unstructured lumigraph rendering: nearest angles [Vlasic 2003, §5]
};

// How fragments are put into the order of their depths.
enum class Order {
  list, // a linked list for each pixel, sorted when all are drawn
  peel, // depth peeling: a pass for each layer
  bsp   // triangles back to front by a BSP tree, blended by their alpha, as in the paper
};

inline const char* nameOf(Order order) {
  switch (order) {
  case Order::list:
    return "list";
  case Order::peel:
    return "peel";
  case Order::bsp:
    return "bsp";
  }
  return "";
}

// Bits of half floats: linear colour premultiplied by alpha, and alpha.
using Texel = std::array<uint16_t, 4>;

// The object's box of a view, in a layer of the array texture. A pixel position p of the photograph is at
// scale * (p - low) texels.
struct PackedView {
  Vec2<double> low = {0, 0}, scale = {1, 1};
  int width = 1, height = 1; // of the part that is used
  float white = 0;           // of blocks: radiance that the byte 255 stands for
};

// Views as half floats, or as S3TC (DXT5) blocks. Blocks hold bytes of the root of a colour's share of white,
// not premultiplied, and of alpha. Interpolation takes stored values: premultiplied half floats, or roots.
struct PackedViews {
  int width = 1, height = 1; // of each layer; of blocks multiples of 4
  std::vector<PackedView> views;
  std::vector<Texel> texels;   // layer by layer; none if there are blocks
  std::vector<uint8_t> blocks; // layer by layer, a byte for each texel

  bool isCompressed() const { return !blocks.empty(); }
  size_t layerTexels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  size_t bytes() const { return std::span(texels).size_bytes() + blocks.size(); }
  std::span<const Texel> layer(size_t view) const {
    return std::span(texels).subspan(view * layerTexels(), layerTexels());
  }
  std::span<const uint8_t> layerBlocks(size_t view) const {
    return std::span(blocks).subspan(view * layerTexels(), layerTexels());
  }
};

struct OpacityField {
  Blending method = Blending::vdtm;
  Domain domain = Domain::sphere; // of the triangulation
  Order order = Order::list;
  TriangleMesh mesh;
  std::vector<capture::Camera<AcquisitionSpace>> cameras; // plain pinholes; of each view
  VisibleViews visible;
  PackedViews packed;
};

} // namespace surflect::olf
