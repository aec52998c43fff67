// Resampling of scattered views onto a regular grid of viewing directions.
//
// The views' points on the disc are triangulated (Delaunay), and each cell of the grid blends the three views
// around it by barycentric weights. A cell outside the hull of the views blends the two views at the nearest
// point of its border.
// [Chen 2002, §5.2, Fig. 7] Chen et al.: Light Field Mapping, SIGGRAPH.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// Regular grid of viewing directions: cells of the square around the disc of a vertex.  [Chen 2002, §5.2]
// Cell (i, j) is stored at j * size + i, with its centre at ((i + 1/2) / size, (j + 1/2) / size), as the
// texels of a texture.
class ViewGrid {
public:
  // Throws Error unless 2 <= size <= kLargest.
  explicit ViewGrid(int size = 32);
  static constexpr int kLargest = 256;

  int size() const { return size_; }
  size_t cells() const { return static_cast<size_t>(size_) * static_cast<size_t>(size_); }
  DiscPoint center(size_t cell) const;
  // Returns whether the centre is in the disc. Other cells show no direction, and count in no reported error.
  bool isInDisc(size_t cell) const;

private:
  int size_;
};

// Delaunay triangulation of points on the disc, called sites.

// Twice the signed area of a triangle; positive if it is counter-clockwise.
inline double doubledArea(const DiscPoint& a, const DiscPoint& b, const DiscPoint& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Least doubledArea() of a triangle that counts as one.
inline constexpr double kLeastArea = 1e-10;

// Triangles, counter-clockwise, each starting at its lowest corner, in rising order: the lower side of the
// convex hull of the sites on a paraboloid, by Qhull. None if the sites are (nearly) collinear. Sites
// (nearly) equal to others, and slivers along the border, may be left out. Sites are finite.
std::vector<std::array<uint32_t, 3>> delaunayTriangles(std::span<const DiscPoint> sites);

// Triangles between sites.
struct SiteMesh {
  std::vector<std::array<uint32_t, 3>> triangles; // counter-clockwise, with an area
  // Border of the triangles. Without triangles, segments along the line that holds all sites; one site is a
  // segment from itself to itself.
  std::vector<std::array<uint32_t, 2>> borders;

  // Returns whether the triangles keep an area and their orientation when the sites move to these places.
  bool holdsFor(std::span<const DiscPoint> sites) const;
};

// Delaunay triangulation; sites that are (nearly) collinear are joined along their line. Sites
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

// Blends at points of the disc, by the rule of cellBlends(): observed in the hull, or at most `reach` away.
// `places` are triangles in which the search for a point begins, and which it updates: start from 0, and keep
// them while sites and points move little. #places = #blends = #points. There must be a site.
void pointBlends(const SiteMesh& mesh, std::span<const DiscPoint> sites, std::span<const DiscPoint> points,
                 double reach, std::span<uint32_t> places, std::span<CellBlend> blends);

} // namespace surflect::lfm
