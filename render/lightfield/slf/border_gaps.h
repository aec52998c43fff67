// Gaps between parts of a border in the plane: outside of it they must not be narrow and deep.
//
// A texel beyond a border takes the value of the border's nearest point. In a gap as narrow as a texel,
// places on one side would read texels of the other side, which may be far away on the surface.
#pragma once

#include "surfel/math/space.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::slf {

// Least distance between two points of a border across its outside: this share of the border's length between
// them less half a clearance, which lets small notches close; but not more than the clearance.
inline constexpr double kGapShare = 0.5;
double leastGap(double length, double clearance);

// A counter-clockwise polygon whose vertices move one at a time.
class MovingBorder {
public:
  explicit MovingBorder(std::vector<Vec2<double>> polygon);

  std::span<const Vec2<double>> polygon() const { return polygon_; }
  void move(size_t vertex, const Vec2<double>& to);

  // Returns whether two edges that are not neighbours would come as near as `margin` if a vertex moved.
  bool wouldCross(size_t vertex, const Vec2<double>& to, double margin) const;
  // Returns whether a moved vertex would make a gap too narrow: a vertex and an edge that faces it would be
  // nearer than leastGap(), and nearer than before the move. Compares the vertex with all edges, and its two
  // edges with all vertices.
  bool wouldNarrowGap(size_t vertex, const Vec2<double>& to, double clearance) const;

private:
  size_t after(size_t vertex) const { return vertex + 1 < polygon_.size() ? vertex + 1 : 0; }
  size_t before(size_t vertex) const { return (vertex > 0 ? vertex : polygon_.size()) - 1; }

  std::vector<Vec2<double>> polygon_;
  std::vector<double> lengths_; // of the edge from each vertex
  double perimeter_ = 0;
};

} // namespace surflect::slf
