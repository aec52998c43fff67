#include "render/lightfield/common/sight.h"

#include "srf/weights/fades.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace surflect::lightfield {

namespace {

using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

// Least fade: a photograph that sees a point badly still counts where it is the only one.
constexpr double kLeastFade = 1e-3;

// Largest difference in distance between a point and a surface through it, over the four pixels around the
// point, which are at most sqrt(2) pixels away, with as much again for curvature.
double depthTolerance(double footprint, double cosTheta) {
  const double tangent = std::sqrt(std::max(0.0, 1 - cosTheta * cosTheta)) / cosTheta;
  return 2 * std::sqrt(2.0) * footprint * (tangent + 0.5);
}

// Distance along the ray of a pixel, which begins at the camera or in the plane of an orthographic one.
double rayDistance(const capture::Camera<AcquisitionSpace>& camera,
                   const capture::Viewpoint<AcquisitionSpace>& viewpoint, const Point& point) {
  return viewpoint.isDistant() ? -camera.cameraFromWorld(point).z() : viewpoint.distance(point);
}

// Width of a pixel at a point.
double footprintAt(const capture::Lens& lens, const capture::Viewpoint<AcquisitionSpace>& viewpoint,
                   const Point& point) {
  const double focal = std::min(lens.focalX, lens.focalY);
  return (viewpoint.isDistant() ? 1 : viewpoint.distance(point)) / focal;
}

} // namespace

SurfacePoint surfacePoint(const TriangleMesh& mesh, const SmoothNormals& normals, size_t triangle,
                          const Point& position) {
  return {position, areaVector(mesh, triangle).normalized(), normals.at(triangle, position.raw())};
}

Sight::Sight(const Photographs& photographs, const RayCaster<AcquisitionSpace>& rays)
    : photographs_(photographs), rays_(rays) {
  for (size_t p = 0; p < photographs.size(); ++p) {
    viewpoints_.emplace_back(photographs.camera(p));
    projectors_.emplace_back(photographs.camera(p));
  }
}

std::optional<Observation> Sight::observe(size_t photograph, const SurfacePoint& point) const {
  const capture::Viewpoint<AcquisitionSpace>& viewpoint = viewpoints_[photograph];
  const Direction towards = viewpoint.towards(point.position);
  const double cosTheta = towards.raw().dot(point.face);
  if (!(cosTheta > kGrazing)) return std::nullopt;
  const std::optional<capture::Pixel> pixel = projectors_[photograph](point.position);
  if (!pixel) return std::nullopt;
  const capture::Camera<AcquisitionSpace>& camera = photographs_.camera(photograph);
  const double offset = rays_.selfHitOffset();
  const auto sample =
      photographs_.at(photograph, *pixel, rayDistance(camera, viewpoint, point.position),
                      depthTolerance(footprintAt(camera.lens, viewpoint, point.position), cosTheta) + offset);
  if (!sample) return std::nullopt;
  const Point lifted = point.position + assume<Direction>(offset * point.face);
  if (rays_.occluded(lifted, towards, offset, viewpoint.distance(point.position))) return std::nullopt;
  const double fade = weights::grazingFade(towards.raw().dot(point.normal)) *
                      weights::borderFade(camera.lens, *pixel) * static_cast<double>(sample->fade);
  return Observation{static_cast<uint32_t>(photograph), towards.cast<float>(), sample->radiance,
                     static_cast<float>(std::max(kLeastFade, fade))};
}

std::vector<Observation> Sight::observations(const SurfacePoint& point) const {
  std::vector<Observation> seen;
  for (size_t p = 0; p < photographs(); ++p)
    if (const std::optional<Observation> observation = observe(p, point)) seen.push_back(*observation);
  return seen;
}

namespace {

// Width of a pixel at a point; empty where the camera does not see it or the surface faces away.
std::optional<double> footprintAt(const Point3<AcquisitionSpace, double>& point, const Vec3<double>& normal,
                                  const capture::Camera<AcquisitionSpace>& camera,
                                  const capture::Viewpoint<AcquisitionSpace>& viewpoint) {
  if (!(viewpoint.towards(point).raw().dot(normal) > 0)) return std::nullopt;
  const std::optional<capture::Pixel> pixel = camera.project(point);
  if (!pixel || !capture::contains(camera.lens, *pixel)) return std::nullopt;
  const double focal = std::sqrt(camera.lens.focalX * camera.lens.focalY);
  return (viewpoint.isDistant() ? 1 : viewpoint.distance(point)) / focal;
}

} // namespace

double pixelFootprint(const TriangleMesh& mesh, std::span<const capture::Camera<AcquisitionSpace>> cameras) {
  constexpr double kPoints = 1000;
  const double area = surfaceArea(mesh);
  std::vector<double> footprints;
  double passed = 0, points = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3<double> areas = areaVector(mesh, t);
    passed += areas.norm() / 2;
    if (!(passed * kPoints > (points + 0.5) * area)) continue;
    points = std::floor(passed * kPoints / area) + 1; // one point for a large triangle, too
    Vec3<double> middle = Vec3<double>::Zero();
    for (const uint32_t v : mesh.triangles[t]) middle += mesh.positions[v].raw().cast<double>() / 3;
    for (const capture::Camera<AcquisitionSpace>& camera : cameras)
      if (const auto footprint = footprintAt(assume<Point3<AcquisitionSpace, double>>(middle), areas, camera,
                                             capture::Viewpoint<AcquisitionSpace>(camera)))
        footprints.push_back(*footprint);
  }
  if (footprints.empty()) return 0;
  const auto middle = footprints.begin() + static_cast<std::ptrdiff_t>(footprints.size() / 2);
  std::ranges::nth_element(footprints, middle);
  return *middle;
}

} // namespace surflect::lightfield
