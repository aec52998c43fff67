// [Badoiu 2003] Badoiu, Clarkson: Smaller Core-Sets for Balls.
#include "render/lightfield/slf/cone.h"

#include <cmath>
#include <vector>

namespace surflect::slf {

namespace {

// Unit vector at an angle from a unit vector, on the great circle towards another.
Vec3<double> turned(const Vec3<double>& from, const Vec3<double>& towards, double angle) {
  Vec3<double> side = towards - from.dot(towards) * from;
  if (side.norm() < 1e-12) side = from.unitOrthogonal(); // equal or opposite: any circle
  return (std::cos(angle) * from + std::sin(angle) * side.normalized()).normalized();
}

} // namespace

double angleBetween(const Vec3<double>& a, const Vec3<double>& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Cone coneAround(const Cone& a, const Cone& b) {
  if (a.isEmpty()) return b;
  if (b.isEmpty()) return a;
  const double between = angleBetween(a.axis, b.axis);
  const double alpha = a.halfAngle.radians(), beta = b.halfAngle.radians();
  if (between + beta <= alpha) return a;
  if (between + alpha <= beta) return b;
  const double half = (between + alpha + beta) / 2;
  if (half >= std::numbers::pi) return {a.axis, Angle::fromRadians(std::numbers::pi)};
  return {turned(a.axis, b.axis, half - alpha), Angle::fromRadians(half)};
}

Cone coneAround(std::span<const Vec3<double>> directions) {
  std::vector<Vec3<double>> units;
  Vec3<double> sum = Vec3<double>::Zero();
  for (const Vec3<double>& direction : directions) {
    const Vec3<double> unit = direction.stableNormalized();
    if (!unit.isZero(0)) units.push_back(unit), sum += unit;
  }
  if (units.empty()) return {};

  // Steps towards the furthest direction, shorter and shorter, come as near as wanted to the centre of the
  // smallest cap while it is within a hemisphere [Badoiu 2003].
  Vec3<double> axis = sum.isZero(0) ? units.front() : Vec3<double>(sum.normalized());
  Cone best{axis, Angle::fromRadians(std::numbers::pi)};
  constexpr int kSteps = 200;
  for (int step = 1; step <= kSteps; ++step) {
    double furthest = -1;
    const Vec3<double>* to = nullptr;
    for (const Vec3<double>& unit : units)
      if (const double distance = (unit - axis).squaredNorm(); distance > furthest)
        furthest = distance, to = &unit;
    const double angle = angleBetween(axis, *to);
    if (angle < best.halfAngle.radians()) best = {axis, Angle::fromRadians(angle)};
    if (angle < 1e-9) break;
    axis = turned(axis, *to, angle / (step + 1));
  }
  return best;
}

Cone normalCone(const TriangleMesh& mesh, std::span<const uint32_t> triangles) {
  std::vector<Vec3<double>> normals;
  for (const uint32_t triangle : triangles) normals.push_back(areaVector(mesh, triangle));
  return coneAround(normals);
}

} // namespace surflect::slf
