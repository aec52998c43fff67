#include "srf/proxy/relief/frontal_plane.h"

namespace surflect::relief {

double frontalDepth(const capture::Camera<AcquisitionSpace>& camera) {
  const double depth = -camera.cameraFromWorld(Point3<AcquisitionSpace, double>(0, 0, 0)).z();
  return camera.lens.model == capture::Lens::Model::orthographic || depth > 1e-6 ? depth : 1;
}

std::optional<Vec2<double>> imagePoint(const capture::Lens& lens, capture::Pixel pixel) {
  const auto ray = capture::rayThrough(lens, pixel);
  if (!ray) return std::nullopt;
  if (lens.model == capture::Lens::Model::orthographic) return Vec2<double>(ray->origin.x(), ray->origin.y());
  return Vec2<double>(ray->direction.x(), ray->direction.y()) / -ray->direction.z();
}

Point3<CameraSpace, double> atDepth(const capture::Lens& lens, const Vec2<double>& q, double depth) {
  if (lens.model == capture::Lens::Model::orthographic) return {q[0], q[1], -depth};
  return {depth * q[0], depth * q[1], -depth};
}

} // namespace surflect::relief
