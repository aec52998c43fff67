#include "render/lightfield/spherical/visible_pencils.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace surflect::spherical {

namespace {

double angleBetween(const Vec3<double>& a, const Vec3<double>& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Whether all points lie beyond the great circle through two corners of a polygon, outside of it.
bool isBeyond(const Vec3<double>& from, const Vec3<double>& to, std::span<const Vec3<double>> points) {
  const Vec3<double> inwards = from.cross(to);
  return std::ranges::all_of(points, [&](const Vec3<double>& p) { return inwards.dot(p) < 0; });
}

// Whether a side of a convex polygon (counter-clockwise) separates it from points.
bool isSeparating(std::span<const Vec3<double>> polygon, std::span<const Vec3<double>> points) {
  for (size_t i = 0; i < polygon.size(); ++i)
    if (isBeyond(polygon[i], polygon[(i + 1) % polygon.size()], points)) return true;
  return false;
}

// A pencil's middle and the angle to its corners, or a window's.
struct Cap {
  Vec3<double> middle;
  double angle;
};
Cap capOf(std::span<const Vec3<double>> polygon) {
  Vec3<double> sum = Vec3<double>::Zero();
  for (const Vec3<double>& corner : polygon) sum += corner;
  Cap cap{sum.normalized(), 0};
  for (const Vec3<double>& corner : polygon)
    cap.angle = std::max(cap.angle, angleBetween(cap.middle, corner));
  return cap;
}

// Least angle between a direction and an arc.
double angleToArc(const Vec3<double>& direction, const Vec3<double>& from, const Vec3<double>& to) {
  const Vec3<double> normal = from.cross(to).normalized();
  const Vec3<double> foot = direction - normal.dot(direction) * normal;
  if (from.cross(foot).dot(normal) > 0 && foot.cross(to).dot(normal) > 0)
    return angleBetween(direction, foot);
  return std::min(angleBetween(direction, from), angleBetween(direction, to));
}

bool overlapsCone(const Corners& corners, const Window& window) {
  if (window.angle > std::numbers::pi) return true;
  bool isInside = true;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3<double>&from = corners[i], &to = corners[(i + 1) % 3];
    if (angleToArc(window.axis, from, to) < window.angle) return true;
    isInside &= from.cross(to).dot(window.axis) >= 0;
  }
  return isInside;
}

bool overlapsWindow(const Corners& corners, const Window& window) {
  const Cap pencil = capOf(corners), all = capOf(window.corners);
  // Farther apart than this, the sides' great circles meet both again on the far side.
  if (angleBetween(pencil.middle, all.middle) > pencil.angle + all.angle) return false;
  return !isSeparating(corners, window.corners) && !isSeparating(window.corners, corners);
}

// Solid angle of a triangle of directions [Van Oosterom and Strackee 1983].
double solidAngle(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& c) {
  return 2 * std::atan2(std::abs(a.dot(b.cross(c))), 1 + a.dot(b) + b.dot(c) + c.dot(a));
}

} // namespace

Window windowOf(const capture::Camera<AcquisitionSpace>& camera, const Sphere& sphere) {
  const capture::Lens& lens = camera.lens;
  if (lens.model != capture::Lens::Model::pinhole)
    throw Error::mismatch("a pinhole", "an orthographic camera").at("camera");
  if (lens.distorts()) throw Error::mismatch("a lens without distortion", "one that distorts").at("camera");
  Window window;
  // Directions towards the viewer are opposite to those of the rays, so that the picture's corners are
  // counter-clockwise in the order in which they are clockwise in the picture seen by the viewer.
  const double width = lens.width, height = lens.height;
  const std::array<capture::Pixel, 4> pixels{{{0, 0}, {0, height}, {width, height}, {width, 0}}};
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  for (size_t i = 0; i < 4; ++i)
    window.corners[i] = -worldFromCamera(capture::rayThrough(lens, pixels[i])->direction).raw();
  const Vec3<double> middle = (window.corners[0] + window.corners[2]).normalized();
  if (window.corners[0].cross(window.corners[1]).dot(middle) < 0) std::ranges::reverse(window.corners);
  const Vec3<double> viewer = camera.center().raw() - sphere.middle;
  if (const double distance = viewer.norm(); distance > sphere.radius) {
    window.axis = viewer / distance;
    window.angle = std::asin(sphere.radius / distance);
  }
  return window;
}

Window wholeWindow(Window window) {
  window.angle = 4;
  return window;
}

std::vector<Pencil> visiblePencils(const DirectionTree& tree, size_t level, const Window& window,
                                   const Progress& progress) {
  const auto isVisible = [&](const Pencil& pencil) {
    const Corners corners = tree.corners(pencil);
    return overlapsWindow(corners, window) && overlapsCone(corners, window);
  };
  std::vector<Pencil> visible;
  for (uint32_t face = 0; face < pencilsOf(0); ++face)
    if (isVisible({0, face})) visible.push_back({0, face});
  for (uint32_t finer = 1; finer <= level; ++finer) {
    std::vector<Pencil> children;
    for (const Pencil& parent : visible) {
      progress.checkpoint();
      for (uint32_t child = 0; child < 4; ++child)
        if (const Pencil pencil{finer, 4 * parent.index + child}; isVisible(pencil))
          children.push_back(pencil);
    }
    visible = std::move(children);
  }
  return visible;
}

double estimatedPencils(size_t level, const Window& window) {
  constexpr double kPi = std::numbers::pi;
  const auto& [p, q, r, s] = window.corners;
  const double omega = solidAngle(p, q, r) + solidAngle(p, r, s);
  const double borderOfWindow =
      angleBetween(p, q) + angleBetween(q, r) + angleBetween(r, s) + angleBetween(s, p);
  const double a = 4 * kPi / static_cast<double>(pencilsOf(level));
  // Border of an equilateral triangle of area a = sqrt(3) / 4 side^2.
  const double borderOfPencil = 3 * std::sqrt(4 * a / std::sqrt(3.0));
  return omega / a                                          // those whose middle is inside, about
         + 1                                                // a window of no size is in one pencil
         + borderOfWindow * borderOfPencil / (2 * kPi * a); // those that the border cuts
}

} // namespace surflect::spherical
