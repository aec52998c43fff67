#include "render/lightfield/slf/stretch.h"

#include <cmath>
#include <cstdint>
#include <limits>

namespace surflect::slf {

double Metric::largest() const { return std::sqrt((a + c + std::hypot(a - c, 2 * b)) / 2); }

Metric metricOf(const std::array<Vec3<double>, 3>& q, const std::array<Vec2<double>, 3>& p) {
  const double twiceArea = 2 * planeArea(p[0], p[1], p[2]);
  // With edges from the first corner, S_s and S_t need no differences of far positions.
  const Vec3<double> d = q[1] - q[0], e = q[2] - q[0];
  const Vec2<double> pd = p[1] - p[0], pe = p[2] - p[0];
  const Vec3<double> ss = (d * pe.y() - e * pd.y()) / twiceArea;
  const Vec3<double> st = (e * pd.x() - d * pe.x()) / twiceArea;
  return {ss.squaredNorm(), ss.dot(st), st.squaredNorm()};
}

double StretchSums::leastStretch() const {
  // A sum of infinity and 0 is infinite, where their product is not a number.
  return std::isfinite(a + c) ? 2 * std::sqrt(a) * std::sqrt(c) : std::numeric_limits<double>::infinity();
}

double StretchSums::bestAspect() const { return std::sqrt(a / c); }

StretchSums stretchSums(std::span<const Vec3<double>> positions,
                        std::span<const std::array<uint32_t, 3>> triangles, Coordinates coordinates) {
  StretchSums sums;
  for (const auto& [i, j, k] : triangles) {
    const std::array q = {positions[i], positions[j], positions[k]};
    const std::array p = {coordinates[i], coordinates[j], coordinates[k]};
    const double area = (q[1] - q[0]).cross(q[2] - q[0]).norm() / 2;
    const double flat = planeArea(p[0], p[1], p[2]);
    sums.area += area, sums.planeArea += flat;
    if (!(flat > 0)) {
      sums.a = sums.c = std::numeric_limits<double>::infinity();
      continue;
    }
    const Metric metric = metricOf(q, p);
    sums.a += area * metric.a, sums.c += area * metric.c;
  }
  return sums;
}

} // namespace surflect::slf
