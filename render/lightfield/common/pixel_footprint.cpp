#include "render/lightfield/common/pixel_footprint.h"

#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace surflect::lightfield {

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
