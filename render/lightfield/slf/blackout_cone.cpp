#include "render/lightfield/slf/blackout_cone.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace surflect::slf {

// [Badoiu 2003] Badoiu, Clarkson: Smaller Core-Sets for Balls.
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

namespace {

constexpr double kPi = std::numbers::pi;
constexpr size_t kSides = kPrismCorners / 2;

// Interval of the points along an axis.
struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
};
Extent extentOf(std::span<const Vec3<double>> points, const Vec3<double>& axis) {
  Extent extent;
  for (const Vec3<double>& point : points) {
    const double along = axis.dot(point);
    extent.low = std::min(extent.low, along);
    extent.high = std::max(extent.high, along);
  }
  return extent;
}

// Prism along the axis; its sides touch the points, so that neighbouring sides meet in its corners.
std::array<Vec3<double>, kPrismCorners> prismAround(std::span<const Vec3<double>> points,
                                                    const Vec3<double>& axis) {
  const Vec3<double> u = axis.unitOrthogonal(), v = axis.cross(u);
  std::array<double, kSides> support{}; // distance of each side from the origin
  const auto outwards = [&](size_t side) -> Vec3<double> {
    const double angle = 2 * kPi * static_cast<double>(side) / kSides;
    return std::cos(angle) * u + std::sin(angle) * v;
  };
  for (size_t side = 0; side < kSides; ++side) support[side] = extentOf(points, outwards(side)).high;
  const Extent height = extentOf(points, axis);

  std::array<Vec3<double>, kPrismCorners> corners;
  for (size_t side = 0; side < kSides; ++side) {
    const Vec3<double> a = outwards(side), b = outwards((side + 1) % kSides);
    const double sa = support[side], sb = support[(side + 1) % kSides], ab = a.dot(b);
    // x a + y b lies on both sides.
    const double x = (sa - ab * sb) / (1 - ab * ab), y = (sb - ab * sa) / (1 - ab * ab);
    corners[2 * side] = x * a + y * b + height.low * axis;
    corners[2 * side + 1] = x * a + y * b + height.high * axis;
  }
  return corners;
}

} // namespace

Cone blackoutCone(const Cone& normals) {
  const double angle = kPi / 2 - normals.halfAngle.radians() - kTurnOver;
  if (normals.isEmpty() || !(angle > 0)) return {};
  return {-normals.axis, Angle::fromRadians(angle)};
}

RegionBound boundOf(const TriangleMesh& mesh, const Chart& chart) {
  assert(!chart.triangles.empty());
  std::vector<Vec3<double>> points, normals;
  Vec3<double> sum = Vec3<double>::Zero();
  for (const uint32_t vertex : chart.vertices) points.push_back(mesh.positions[vertex].cast<double>().raw());
  for (const auto& [a, b, c] : chart.triangles)
    sum += normals.emplace_back((points[b] - points[a]).cross(points[c] - points[a]));
  const Cone ofNormals = coneAround(normals);
  RegionBound bound;
  bound.blackout = blackoutCone(ofNormals);
  const Vec3<double> axis = !bound.blackout.isEmpty() ? ofNormals.axis
                            : sum.squaredNorm() > 0   ? Vec3<double>(sum.normalized())
                                                      : Vec3<double>(Vec3<double>::UnitZ());
  bound.corners = prismAround(points, axis);
  return bound;
}

RegionView viewOf(const RegionBound& bound, const Vec3<double>& viewer) {
  RegionView view;
  view.directions.reserve(kPrismCorners);
  Vec3<double> middle = Vec3<double>::Zero();
  double scale = 0; // of the prism
  for (const Vec3<double>& corner : bound.corners) middle += corner / static_cast<double>(kPrismCorners);
  for (const Vec3<double>& corner : bound.corners) scale = std::max(scale, (corner - middle).norm());
  view.cone.axis = (viewer - middle).normalized();
  bool isOutside = (viewer - middle).norm() > 1e-6 * scale;
  for (const Vec3<double>& corner : bound.corners) {
    const Vec3<double> direction = viewer - corner;
    const bool isApart = direction.norm() > 1e-6 * scale && direction.norm() > 0;
    isOutside &= isApart;
    view.directions.push_back(isApart ? Vec3<double>(direction.normalized())
                                      : Vec3<double>(Vec3<double>::UnitZ()));
  }
  double widest = 0;
  for (const Vec3<double>& direction : view.directions)
    widest = std::max(widest, angleBetween(view.cone.axis, direction));
  view.cone.halfAngle = Angle::fromRadians(widest);
  // From inside, some corners lie in front and some behind.
  constexpr double kNearlyInside = kPi / 2 - 0.01;
  if (!isOutside || !(widest < kNearlyInside)) view.cone = allDirections();
  return view;
}

bool isBackFacing(const RegionBound& bound, const RegionView& view) {
  return !bound.blackout.isEmpty() &&
         angleBetween(bound.blackout.axis, view.cone.axis) + view.cone.halfAngle.radians() <
             bound.blackout.halfAngle.radians();
}

std::optional<gl::Rect> screenRect(const RegionBound& bound,
                                   const capture::Camera<AcquisitionSpace>& camera) {
  const capture::Lens& lens = camera.lens;
  assert(lens.model == capture::Lens::Model::pinhole && !lens.distorts());
  Eigen::AlignedBox2d box;
  size_t inFront = 0;
  for (const Vec3<double>& corner : bound.corners) {
    const Vec3<double> p = camera.cameraFromWorld(assume<Point3<AcquisitionSpace, double>>(corner)).raw();
    if (!(-p.z() > 0)) continue;
    ++inFront;
    box.extend(
        Vec2<double>(lens.centerX - lens.focalX * p.x() / p.z(), lens.centerY + lens.focalY * p.y() / p.z()));
  }
  const gl::Rect whole{0, 0, lens.width, lens.height};
  if (inFront == 0) return std::nullopt;
  if (inFront < kPrismCorners) return whole; // reaches from before the camera to behind it
  const auto pixel = [](double position, int size) {
    return static_cast<int>(std::clamp(std::floor(position), -1.0, size + 1.0));
  };
  // Half a pixel of margin for rounding.
  const int left = std::max(0, pixel(box.min().x() - 0.5, lens.width));
  const int top = std::max(0, pixel(box.min().y() - 0.5, lens.height));
  const int right = std::min(lens.width, pixel(box.max().x() + 0.5, lens.width) + 1);
  const int bottom = std::min(lens.height, pixel(box.max().y() + 0.5, lens.height) + 1);
  if (left >= right || top >= bottom) return std::nullopt;
  return gl::Rect{left, top, right - left, bottom - top};
}

} // namespace surflect::slf
