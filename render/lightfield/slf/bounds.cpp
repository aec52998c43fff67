#include "render/lightfield/slf/bounds.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace surflect::slf {

namespace {

constexpr double kPi = std::numbers::pi;
Cone allDirections() { return {{0, 0, 1}, kPi}; }
constexpr size_t kSides = kPrismCorners / 2;

double angleBetween(const Vec3<double>& a, const Vec3<double>& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Centre of a ball around points, nearly the smallest. [Badoiu, Clarkson 2003, Smaller Core-Sets for Balls]
Vec3<double> ballCenter(std::span<const Vec3<double>> points) {
  constexpr int kSteps = 64;
  Vec3<double> center = Vec3<double>::Zero();
  for (const Vec3<double>& point : points) center += point / static_cast<double>(points.size());
  for (int step = 1; step <= kSteps; ++step) {
    const auto& farthest = *std::ranges::max_element(
        points, {}, [&](const Vec3<double>& point) { return (point - center).squaredNorm(); });
    center += (farthest - center) / (step + 1);
  }
  return center;
}

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

Cone coneAround(std::span<const Vec3<double>> directions) {
  if (directions.empty()) return allDirections();
  std::vector<Vec3<double>> units;
  for (const Vec3<double>& direction : directions) {
    const double length = direction.norm();
    if (!(length > 0 && length < std::numeric_limits<double>::infinity())) return allDirections();
    units.push_back(direction / length);
  }
  // The narrowest cone of less than a half space is that of the smallest ball around the unit directions.
  const Vec3<double> center = ballCenter(units);
  if (!(center.norm() > 1e-6)) return allDirections();
  Cone cone{center.normalized(), 0};
  for (const Vec3<double>& unit : units) {
    const double angle = angleBetween(cone.axis, unit);
    if (!(angle < kPi / 2)) return allDirections();
    cone.angle = std::max(cone.angle, angle);
  }
  return cone;
}

RegionBound boundOf(const TriangleMesh& mesh, const Chart& chart) {
  assert(!chart.triangles.empty());
  std::vector<Vec3<double>> points, normals;
  Vec3<double> sum = Vec3<double>::Zero();
  for (const uint32_t vertex : chart.vertices) points.push_back(mesh.positions[vertex].cast<double>().raw());
  for (const auto& [a, b, c] : chart.triangles) {
    const Vec3<double> normal = (points[b] - points[a]).cross(points[c] - points[a]);
    if (normal.squaredNorm() > 0) normals.push_back(normal);
    sum += normal;
  }
  RegionBound bound;
  bound.normals = coneAround(normals);
  const bool isFlat = bound.normals.angle < kPi / 2;
  const bool hasMean = sum.squaredNorm() > 0;
  bound.corners = prismAround(points, isFlat    ? bound.normals.axis
                                      : hasMean ? Vec3<double>(sum.normalized())
                                                : Vec3<double>(Vec3<double>::UnitZ()));
  return bound;
}

RegionView viewOf(const RegionBound& bound, const Vec3<double>& viewer) {
  RegionView view;
  Vec3<double> middle = Vec3<double>::Zero();
  double scale = 0; // of the prism
  for (const Vec3<double>& corner : bound.corners) middle += corner / static_cast<double>(kPrismCorners);
  for (const Vec3<double>& corner : bound.corners) scale = std::max(scale, (corner - middle).norm());
  view.cone = {(viewer - middle).normalized(), 0};
  bool isOutside = (viewer - middle).norm() > 1e-6 * scale;
  for (size_t i = 0; i < kPrismCorners; ++i) {
    const Vec3<double> direction = viewer - bound.corners[i];
    const bool isApart = direction.norm() > 1e-6 * scale && direction.norm() > 0;
    isOutside &= isApart;
    view.directions[i] = isApart ? Vec3<double>(direction.normalized()) : Vec3<double>(Vec3<double>::UnitZ());
  }
  if (isOutside)
    for (const Vec3<double>& direction : view.directions)
      view.cone.angle = std::max(view.cone.angle, angleBetween(view.cone.axis, direction));
  // From inside, some corners lie in front and some behind.
  constexpr double kNearlyInside = kPi / 2 - 0.01;
  if (!isOutside || !(view.cone.angle < kNearlyInside)) view.cone = allDirections();
  return view;
}

bool isBackFacing(const RegionBound& bound, const RegionView& view) {
  if (!(bound.normals.angle < kPi / 2) || !(view.cone.angle < kPi / 2)) return false;
  return angleBetween(bound.normals.axis, view.cone.axis) >
         kPi / 2 + bound.normals.angle + view.cone.angle + kTurnOver;
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
