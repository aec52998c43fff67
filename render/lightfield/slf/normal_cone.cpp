#include "render/lightfield/slf/normal_cone.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace surflect::slf {

namespace {

// Exact also where they are nearly equal or opposite.
double angleBetweenUnits(const Vec3<double>& a, const Vec3<double>& b) {
  return 2 * std::atan2((a - b).norm(), (a + b).norm());
}

// Unit vector at an angle from a unit vector, on the great circle towards another.
Vec3<double> turned(const Vec3<double>& from, const Vec3<double>& towards, double angle) {
  Vec3<double> side = towards - from.dot(towards) * from;
  if (side.norm() < 1e-12) side = from.unitOrthogonal(); // equal or opposite: any circle
  return (std::cos(angle) * from + std::sin(angle) * side.normalized()).normalized();
}

} // namespace

NormalCone coneAround(const NormalCone& a, const NormalCone& b) {
  if (a.isEmpty()) return b;
  if (b.isEmpty()) return a;
  const double between = angleBetweenUnits(a.axis, b.axis);
  const double alpha = a.halfAngle.radians(), beta = b.halfAngle.radians();
  if (between + beta <= alpha) return a;
  if (between + alpha <= beta) return b;
  const double half = (between + alpha + beta) / 2;
  if (half >= std::numbers::pi) return {a.axis, Angle::fromRadians(std::numbers::pi)};
  return {turned(a.axis, b.axis, half - alpha), Angle::fromRadians(half)};
}

NormalCone normalCone(const TriangleMesh& mesh, std::span<const uint32_t> triangles) {
  std::vector<Vec3<double>> normals;
  Vec3<double> sum = Vec3<double>::Zero();
  for (const uint32_t triangle : triangles) {
    const Vec3<double> normal = areaVector(mesh, triangle).stableNormalized();
    if (!normal.isZero(0)) normals.push_back(normal), sum += normal;
  }
  if (normals.empty()) return {};

  // Steps towards the furthest normal, shorter and shorter, come as near as wanted to the centre of the
  // smallest cap while it is within a hemisphere [Badoiu 2003].
  Vec3<double> axis = sum.isZero(0) ? normals.front() : Vec3<double>(sum.normalized());
  NormalCone best{axis, Angle::fromRadians(std::numbers::pi)};
  constexpr int kSteps = 200;
  for (int step = 1; step <= kSteps; ++step) {
    double furthest = -1;
    const Vec3<double>* to = nullptr;
    for (const Vec3<double>& normal : normals)
      if (const double distance = (normal - axis).squaredNorm(); distance > furthest)
        furthest = distance, to = &normal;
    const double angle = angleBetweenUnits(axis, *to);
    if (angle < best.halfAngle.radians()) best = {axis, Angle::fromRadians(angle)};
    if (angle < 1e-9) break;
    axis = turned(axis, *to, angle / (step + 1));
  }
  return best;
}

} // namespace surflect::slf
