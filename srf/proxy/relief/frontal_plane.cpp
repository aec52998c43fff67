#include "srf/proxy/relief/frontal_plane.h"

namespace surflect {

double frontalDepth(const Camera<AcquisitionSpace>& camera) {
  const double depth = -camera.cameraFromWorld(Point3<AcquisitionSpace, double>(0, 0, 0)).z();
  return camera.lens.model == Lens::Model::orthographic || depth > 1e-6 ? depth : 1;
}

std::optional<Vec2<double>> imagePoint(const Lens& lens, Pixel pixel) {
  const auto ray = rayThrough(lens, pixel);
  if (!ray) return std::nullopt;
  if (lens.model == Lens::Model::orthographic) return Vec2<double>(ray->origin.x(), ray->origin.y());
  return Vec2<double>(ray->direction.x(), ray->direction.y()) / -ray->direction.z();
}

Point3<CameraSpace, double> atDepth(const Lens& lens, const Vec2<double>& q, double depth) {
  if (lens.model == Lens::Model::orthographic) return {q[0], q[1], -depth};
  return {depth * q[0], depth * q[1], -depth};
}

} // namespace surflect
