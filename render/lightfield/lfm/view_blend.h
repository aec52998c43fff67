// Resampling of scattered views onto a regular grid of viewing directions.
//
// The views' points on the disc are triangulated (Delaunay), and each cell of the grid blends the three views
// around it by barycentric weights. A cell outside the hull of the views blends the two views at the nearest
// point of its border.
// [Chen 2002, §5.2, Fig. 7] Chen et al.: Light Field Mapping, SIGGRAPH.
#pragma once

#include "render/lightfield/lfm/view_grid.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// Triangles between sites.
struct SiteMesh {
  std::vector<std::array<uint32_t, 3>> triangles; // counter-clockwise, with an area
  // Border of the triangles. Without triangles, segments along the line that holds all sites; one site is a
  // segment from itself to itself.
  std::vector<std::array<uint32_t, 2>> borders;

  // Returns whether the triangles keep an area and their orientation when the sites move to these places.
  bool holdsFor(std::span<const DiscPoint> sites) const;
};

// Delaunay triangulation (delaunay.h); sites that are (nearly) collinear are joined along their line. Sites
// are finite.
SiteMesh siteMesh(std::span<const DiscPoint> sites);

struct CellBlend {
  std::array<uint32_t, 3> sites = {};
  std::array<float, 3> weights = {}; // not negative; sum to 1
  bool isObserved = false;           // in the hull of the sites, or at most the size of a cell away
};

// One for each cell; empty without sites. A value that is linear on the disc is reproduced in the hull.
std::vector<CellBlend> cellBlends(const SiteMesh& mesh, std::span<const DiscPoint> sites,
                                  const ViewGrid& grid);

} // namespace surflect::lfm
