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
// outside of all triangles lies in a cell of the hemisphere between x and a border edge, and blends the two
// views of that edge  [Vlasic 2003, Fig. 2b].
//
// The triangle of d is found by a walk across edges. The paper starts it from the last triangle; frames would
// then depend on those before, in their last bits. Here each cell of a grid over the projection has a
// triangle near it to start from.
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/direction_disc.h"
#include "render/lightfield/lfm/rings.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::olf {

// The views that see each vertex of a mesh.  [Vlasic 2003, §3]

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

// Closest views of a vertex for a viewing direction, with their weights.
// [Vlasic 2003] Vlasic et al.: Opacity Light Fields, I3D.   [Buehler 2001] as in srf/weights/ulr.h.
// Symbols: C_i direction towards view i, d towards the viewer; p_i = 1 - cos(C_i, d) penalty, r_i relevance,
// w_i weight.
struct WeightedView {
  uint32_t view = 0;
  double weight = 0; // not negative
};

// At most three views; their weights sum to one unless there is none.
class ClosestViews {
public:
  static constexpr size_t kMost = 3;

  void push(WeightedView view) {
    assert(count_ < kMost);
    views_[count_++] = view;
  }
  size_t size() const { return count_; }
  const WeightedView* begin() const { return views_.data(); }
  const WeightedView* end() const { return views_.data() + count_; }
  WeightedView* begin() { return views_.data(); }
  WeightedView* end() { return views_.data() + count_; }

private:
  std::array<WeightedView, kMost> views_;
  size_t count_ = 0;
};

// Blends the three views of least penalty by r_i = (cos_i - cos_k) / (1 - cos_i), where k = 4 is the next
// one; with three views k = 3, so that two are blended; with fewer all, with cos_k = 0.
// [Vlasic 2003, §5.1, Eqs. 1-4]  r is clamped at 0; if all are 0 the nearest view has the weight 1. The view
// of a penalty is its index; views of equal penalties keep their order.
ClosestViews ulrViews(std::span<const double> penalties);

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
