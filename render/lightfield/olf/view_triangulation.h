// Delaunay triangulation of the directions towards the views of a vertex, and its barycentric weights.
//
// [Vlasic 2003, §4.1, Figs. 1, 2] Vlasic et al.: Opacity Light Fields, I3D.
// Symbols: C_i directions towards the views, d towards the viewer; x the point that the border is seen from.
//
// In the plane, C_i and d are projected onto the tangent plane of the vertex, as homogeneous points (x, y,
// 1); x is the centroid of the convex hull. On the sphere they stay unit vectors, which avoids the distortion
// that the paper warns of; x is their mean direction. A stereographic projection around x keeps circles
// circles, so the planar Delaunay triangles of the projected C_i are the spherical ones, and x is inside
// their convex hull. In both cases d has the weights with d ~ w_a C_a + w_b C_b + w_c C_c in a triangle. A d
// outside of all triangles blends the two views of the border edge between d and x (Figure 2b).
//
// The triangle of d is found by a walk across edges. The paper starts it from the last triangle; frames would
// then depend on those before, in their last bits. Here each cell of a grid over the projection has a
// triangle near it to start from.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"
#include "render/lightfield/olf/closest_views.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::olf {

enum class Domain { sphere, plane };

class ViewTriangulation {
public:
  static constexpr size_t kMostViews = 32'767; // the triangles of more would need larger indices
  // Bytes of a triangulation for each of its views, nearly.
  static constexpr size_t kBytesOfView = sizeof(Vec3<double>) + 14 * sizeof(uint16_t);

  // Unit directions, kMostViews at most. Those below the tangent plane (z < 0) are not used in the plane, as
  // in the paper.
  ViewTriangulation(std::span<const Vec3<double>> directions, const lfm::VertexFrame& frame, Domain domain);

  // Closest views of a unit direction, as indices of the constructor's directions; none if it had none. Fewer
  // than three views are all used, by the inverse of their distance to d. Three or more in a line blend the
  // two next to the point of the line nearest to d, which the paper does not say.
  ClosestViews at(const Vec3<double>& direction) const;

  size_t triangles() const { return triangles_.size(); }
  size_t bytes() const; // the object itself included

private:
  using Index = uint16_t; // many vertices have many views
  using Corners = std::array<Index, 3>;
  static constexpr Index kNone = UINT16_MAX;
  struct Triangle {
    Corners corners;   // counter-clockwise
    Corners neighbors; // across the edge opposite to each corner; kNone: border
  };
  struct Walk {
    size_t triangle = 0; // the last one
    Vec3<double> weights = Vec3<double>::Zero();
    bool isInside = false; // of the triangle
  };

  Vec3<double> placed(const Vec3<double>& direction) const;
  lfm::DiscPoint flattened(const Vec3<double>& placed) const;
  Vec3<double> raised(const lfm::DiscPoint& p) const; // inverse of flattened()
  size_t cellOf(const lfm::DiscPoint& p) const;
  void fillCells(std::span<const lfm::DiscPoint> sites);
  Walk walkTo(const Vec3<double>& d, size_t from) const;
  Vec3<double> weightsIn(const Corners& corners, const Vec3<double>& d) const;
  ClosestViews inTriangle(const Corners& corners, const Vec3<double>& weights) const;
  ClosestViews outside(const Vec3<double>& d) const;
  ClosestViews alongLine(const Vec3<double>& d) const;
  ClosestViews byDistance(const Vec3<double>& d) const;

  Domain domain_;
  lfm::VertexFrame frame_;
  Vec3<double> center_ = Vec3<double>::Zero(); // x
  std::vector<Index> views_;                   // of each site
  std::vector<Vec3<double>> sites_;
  std::vector<Triangle> triangles_;
  std::vector<std::array<Index, 2>> borders_; // triangles on the left; or segments of a line
  // The grid of starts, cell by cell in rows.
  std::vector<Index> starts_;
  size_t cellsAlong_ = 0;
  lfm::DiscPoint low_ = {0, 0}, cellSize_ = {1, 1};
};

} // namespace surflect::olf
