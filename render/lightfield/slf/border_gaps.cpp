#include "render/lightfield/slf/border_gaps.h"

#include "render/lightfield/slf/plane_border.h"

#include <algorithm>
#include <utility>

namespace surflect::slf {

namespace {

using Point = Vec2<double>;

// Point of a segment nearest to p, as a share of the way from a to b.
double nearestShare(const Point& p, const Point& a, const Point& b) {
  const Point along = b - a;
  const double squared = along.squaredNorm();
  return squared > 0 ? std::clamp((p - a).dot(along) / squared, 0.0, 1.0) : 0;
}

double distanceTo(const Point& p, const Point& a, const Point& b) {
  return (a + nearestShare(p, a, b) * (b - a) - p).norm();
}

bool isNear(const Point& p, const Point& a, const Point& b, double reach) {
  return p.x() > std::min(a.x(), b.x()) - reach && p.x() < std::max(a.x(), b.x()) + reach &&
         p.y() > std::min(a.y(), b.y()) - reach && p.y() < std::max(a.y(), b.y()) + reach;
}

} // namespace

double leastGap(double length, double clearance) {
  return std::min(kGapShare * (length - clearance / 2), clearance);
}

MovingBorder::MovingBorder(std::vector<Point> polygon)
    : polygon_(std::move(polygon)), lengths_(polygon_.size()) {
  for (size_t i = 0; i < polygon_.size(); ++i)
    perimeter_ += lengths_[i] = (polygon_[after(i)] - polygon_[i]).norm();
}

void MovingBorder::move(size_t vertex, const Point& to) {
  polygon_[vertex] = to;
  for (const size_t edge : {before(vertex), vertex}) {
    const double length = (polygon_[after(edge)] - polygon_[edge]).norm();
    perimeter_ += length - lengths_[edge];
    lengths_[edge] = length;
  }
}

bool MovingBorder::wouldCross(size_t vertex, const Point& to, double margin) const {
  const size_t previous = before(vertex), next = after(vertex);
  const Point &low = polygon_[previous], &high = polygon_[next];
  for (size_t i = next; i != previous; i = after(i)) {
    const Point &a = polygon_[i], &b = polygon_[after(i)];
    if (after(i) != previous && segmentsMeet(to, low, a, b, margin)) return true;
    if (i != next && segmentsMeet(to, high, a, b, margin)) return true;
  }
  return false;
}

bool MovingBorder::wouldNarrowGap(size_t vertex, const Point& to, double clearance) const {
  const size_t previous = before(vertex), next = after(vertex);
  const Point &from = polygon_[vertex], &low = polygon_[previous], &high = polygon_[next];
  const double toLow = (to - low).norm(), toHigh = (to - high).norm();
  const double perimeter = perimeter_ - lengths_[previous] - lengths_[vertex] + toLow + toHigh;

  // Distance of p to the edge ab where it is too small, or -1. The border's length from the moved vertex's
  // side to the nearest point is `start` + share `slope`.
  const auto narrow = [&](const Point& p, const Point& a, const Point& b, double start, double slope) {
    if (!isNear(p, a, b, clearance) || planeArea(a, b, p) >= 0) return -1.0; // far, or across the inside
    const double share = nearestShare(p, a, b), length = start + share * slope;
    const double distance = (a + share * (b - a) - p).norm();
    return distance < leastGap(std::min(length, perimeter - length), clearance) ? distance : -1.0;
  };
  double reached = toHigh; // from the moved vertex forwards to vertex i
  for (size_t i = next; i != vertex; reached += lengths_[i], i = after(i)) {
    const Point &a = polygon_[i], &b = polygon_[after(i)];
    if (i != previous) {
      const double edge = narrow(to, a, b, reached, lengths_[i]);
      if (edge >= 0 && edge < distanceTo(from, a, b)) return true;
      const double lower = narrow(a, low, to, reached + toLow, -toLow);
      if (lower >= 0 && lower < distanceTo(a, low, from)) return true;
    }
    if (i != next) {
      const double upper = narrow(a, to, high, reached, -toHigh);
      if (upper >= 0 && upper < distanceTo(a, from, high)) return true;
    }
  }
  return false;
}

} // namespace surflect::slf
