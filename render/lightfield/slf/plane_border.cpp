#include "render/lightfield/slf/plane_border.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace surflect::slf {

namespace {

double squaredDistance(const Vec2<double>& p, const Vec2<double>& a, const Vec2<double>& b) {
  const Vec2<double> along = b - a;
  const double length = along.squaredNorm();
  const double t = length > 0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0;
  return (a + t * along - p).squaredNorm();
}

} // namespace

bool segmentsMeet(const Vec2<double>& a, const Vec2<double>& b, const Vec2<double>& c, const Vec2<double>& d,
                  double margin) {
  for (int axis = 0; axis < 2; ++axis)
    if (std::max(a[axis], b[axis]) + margin < std::min(c[axis], d[axis]) ||
        std::max(c[axis], d[axis]) + margin < std::min(a[axis], b[axis]))
      return false;
  if (planeArea(a, b, c) * planeArea(a, b, d) <= 0 && planeArea(c, d, a) * planeArea(c, d, b) <= 0)
    return true;
  return margin > 0 && std::min({squaredDistance(a, c, d), squaredDistance(b, c, d), squaredDistance(c, a, b),
                                 squaredDistance(d, a, b)}) <= margin * margin;
}

bool crossesItself(std::span<const Vec2<double>> polygon) {
  const size_t n = polygon.size();
  const auto at = [&](size_t i) -> const Vec2<double>& { return polygon[i % n]; };
  const auto left = [&](size_t edge) { return std::min(at(edge).x(), at(edge + 1).x()); };
  const auto right = [&](size_t edge) { return std::max(at(edge).x(), at(edge + 1).x()); };
  std::vector<size_t> edges(n); // by their left ends
  std::iota(edges.begin(), edges.end(), size_t{0});
  std::ranges::stable_sort(edges, {}, left);
  for (size_t i = 0; i < n; ++i)
    for (size_t j = i + 1; j < n && left(edges[j]) <= right(edges[i]); ++j) {
      const size_t e = edges[i], f = edges[j];
      if ((e + 1) % n == f || (f + 1) % n == e) continue;
      if (segmentsMeet(at(e), at(e + 1), at(f), at(f + 1))) return true;
    }
  return false;
}

} // namespace surflect::slf
