#include "render/lightfield/slf/pass_plan.h"

#include "surfel/base/text.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace surflect::slf {

namespace {

void sortUnique(std::vector<uint32_t>& values) {
  std::ranges::sort(values);
  values.erase(std::ranges::unique(values).begin(), values.end());
}

std::vector<uint32_t> cornersOf(const DirectionMesh& mesh, std::span<const uint32_t> triangles) {
  std::vector<uint32_t> corners;
  for (const uint32_t triangle : triangles)
    corners.insert(corners.end(), mesh.triangles()[triangle].begin(), mesh.triangles()[triangle].end());
  sortUnique(corners);
  return corners;
}

// Whether the arc from a to b, two unit directions, may come within `margin` of a direction of the view. The
// arc's plane must not have all corners on one side, and the view's cone must reach the arc.
bool mayMeet(const RegionView& view, const Vec3<double>& a, const Vec3<double>& b, double margin) {
  const Vec3<double> cross = a.cross(b), normal = cross.normalized();
  const double sine = std::sin(margin);
  double low = 1, high = -1;
  for (const Vec3<double>& direction : view.directions) {
    const double side = normal.dot(direction);
    low = std::min(low, side);
    high = std::max(high, side);
  }
  if (low > sine || high < -sine) return false;

  const Vec3<double>& axis = view.cone.axis;
  const double reach = view.cone.halfAngle.radians() + margin;
  // The nearest point of the arc is on its inside where the axis is between the planes through its ends.
  if (normal.cross(a).dot(axis) >= 0 && b.cross(normal).dot(axis) >= 0)
    return std::abs(normal.dot(axis)) <= std::sin(std::min(reach, std::numbers::pi / 2));
  return std::max(a.dot(axis), b.dot(axis)) >= std::cos(std::min(reach, std::numbers::pi));
}

// Directions of the corners of a pixel rectangle, in acquisition space and not unit, as seen by a pinhole.
std::array<Vec3<double>, 4> cornerRays(const gl::Rect& rect,
                                       const capture::Camera<AcquisitionSpace>& camera) {
  const capture::Lens& lens = camera.lens;
  const Mat3<double> worldFromCamera = camera.cameraFromWorld.rotation().transpose();
  std::array<Vec3<double>, 4> rays;
  for (size_t i = 0; i < 4; ++i) {
    const double x = rect.x + (i == 1 || i == 2 ? rect.width : 0);
    const double y = rect.y + (i >= 2 ? rect.height : 0);
    rays[i] = worldFromCamera *
              Vec3<double>((x - lens.centerX) / lens.focalX, (lens.centerY - y) / lens.focalY, -1);
  }
  return rays;
}

// Directions to the viewer along the rays of a pixel rectangle.
RegionView viewThrough(const gl::Rect& rect, const capture::Camera<AcquisitionSpace>& camera) {
  RegionView view;
  Vec3<double> sum = Vec3<double>::Zero();
  for (const Vec3<double>& ray : cornerRays(rect, camera))
    sum += view.directions.emplace_back(-ray.normalized());
  view.cone.axis = sum.normalized();
  double widest = 0;
  for (const Vec3<double>& direction : view.directions)
    widest = std::max(widest, angleBetween(view.cone.axis, direction));
  view.cone.halfAngle = Angle::fromRadians(widest);
  return view;
}

// Part of a convex polygon of rays on the side of a plane through the camera.
std::vector<Vec3<double>> clipped(const std::vector<Vec3<double>>& polygon, const Vec3<double>& inwards) {
  std::vector<Vec3<double>> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3<double>&p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double a = inwards.dot(p), b = inwards.dot(q);
    if (a >= 0) kept.push_back(p);
    if ((a < 0) != (b < 0)) kept.push_back(p + a / (a - b) * (q - p));
  }
  return kept;
}

// Area in pixels of the part of a rectangle whose rays, turned around, are in a triangle of directions.
double areaWithin(const gl::Rect& rect, const capture::Camera<AcquisitionSpace>& camera,
                  const DirectionMesh& mesh, size_t triangle) {
  const auto rays = cornerRays(rect, camera);
  std::vector<Vec3<double>> polygon(rays.begin(), rays.end());
  const auto& corners = mesh.triangles()[triangle];
  for (size_t i = 0; i < 3; ++i)
    polygon = clipped(
        polygon, -mesh.directions()[corners[i]].raw().cross(mesh.directions()[corners[(i + 1) % 3]].raw()));
  // All points are on the plane one unit in front of the camera.
  Vec3<double> doubled = Vec3<double>::Zero();
  for (size_t i = 2; i < polygon.size(); ++i)
    doubled += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
  return doubled.norm() / 2 * camera.lens.focalX * camera.lens.focalY;
}

} // namespace

std::vector<uint32_t> trianglesInView(const DirectionMesh& mesh, const RegionView& view, double margin,
                                      uint32_t& start) {
  if (!(view.cone.halfAngle.radians() + margin < std::numbers::pi / 2)) return upTo(mesh.triangles().size());
  const auto directions = mesh.directions();
  start = mesh.triangleAt(assume<Direction>(view.cone.axis), start);
  std::vector<uint32_t> visited{start};
  // Few triangles are visited, so that a search among them is faster than marks on all.
  for (size_t next = 0; next < visited.size(); ++next) {
    const uint32_t triangle = visited[next];
    const auto& corners = mesh.triangles()[triangle];
    for (size_t corner = 0; corner < 3; ++corner) {
      const uint32_t neighbor = mesh.neighbors(triangle)[corner];
      if (std::ranges::find(visited, neighbor) != visited.end()) continue;
      // In one order from both sides, so that both decide alike.
      const auto [a, b] = std::minmax(corners[(corner + 1) % 3], corners[(corner + 2) % 3]);
      if (mayMeet(view, directions[a].raw(), directions[b].raw(), margin)) visited.push_back(neighbor);
    }
  }
  std::ranges::sort(visited);
  return visited;
}

PassPlanner::PassPlanner(const Field& field) : field_(&field), starts_(field.regions.size()) {
  for (const Region& region : field.regions) bounds_.push_back(boundOf(field.mesh, region.chart));
}

PassPlan PassPlanner::plan(const capture::Camera<AcquisitionSpace>& camera, const PlanOptions& options) {
  // Rasterisers round positions to 1/256 pixel, shaders compute in float.
  const double margin = 0.0625 / std::min(camera.lens.focalX, camera.lens.focalY) + 1e-5;
  const gl::Rect whole{0, 0, camera.lens.width, camera.lens.height};
  PassPlan plan;
  for (uint32_t r = 0; r < field_->regions.size(); ++r) {
    const RegionView view = viewOf(bounds_[r], camera.center().raw());
    const auto rect = screenRect(bounds_[r], camera);
    if (options.regionCulling && (!rect || isBackFacing(bounds_[r], view))) continue;
    RegionPasses passes;
    passes.region = r;
    passes.scissor = options.scissor && rect ? *rect : whole;
    const DirectionMesh& mesh = field_->directionsOf(r);
    if (options.directionCulling) {
      // Both cones hold all directions along which a pixel sees the region. From near, the picture shows a
      // part of it, and has the narrower cone.
      const RegionView shown = viewThrough(rect.value_or(whole), camera);
      const bool isNear = shown.cone.halfAngle.radians() < view.cone.halfAngle.radians();
      passes.triangles = trianglesInView(mesh, isNear ? shown : view, margin, starts_[r]);
      passes.directions = cornersOf(mesh, passes.triangles);
    } else {
      passes.triangles = upTo(mesh.triangles().size());
      passes.directions = upTo(mesh.directions().size());
    }
    plan.regions.push_back(std::move(passes));
  }
  return plan;
}

double basisFill(const Field& field, const PassPlan& plan, const capture::Camera<AcquisitionSpace>& camera,
                 bool visitedOnly) {
  double fill = 0;
  for (const RegionPasses& passes : plan.regions) {
    const DirectionMesh& mesh = field.directionsOf(passes.region);
    const std::vector<uint32_t> triangles = visitedOnly ? passes.triangles : upTo(mesh.triangles().size());
    for (const uint32_t triangle : triangles) {
      const auto& corners = mesh.triangles()[triangle];
      const auto count = std::ranges::count_if(
          corners, [&](uint32_t corner) { return std::ranges::binary_search(passes.directions, corner); });
      if (count > 0) fill += static_cast<double>(count) * areaWithin(passes.scissor, camera, mesh, triangle);
    }
  }
  return fill;
}

} // namespace surflect::slf
