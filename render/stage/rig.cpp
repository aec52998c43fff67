#include "render/stage/rig.h"

#include "surfel/math/sphere_sampling.h"

#include <cmath>
#include <numbers>

namespace surflect::stage {

namespace {

RigDirection at(double z, double azimuth) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return normalized(RigDirection(r * std::cos(azimuth), r * std::sin(azimuth), z));
}

} // namespace

RigDirection direction(Angle azimuth, Angle elevation) {
  return at(std::sin(elevation.radians()), azimuth.radians());
}

std::vector<RigDirection> turntable(int steps, std::span<const Angle> elevations) {
  std::vector<RigDirection> directions;
  for (const Angle elevation : elevations)
    for (int step = 0; step < steps; ++step)
      directions.push_back(at(std::sin(elevation.radians()), 2 * std::numbers::pi * step / steps));
  return directions;
}

std::vector<RigDirection> spiral(int count, double lowest, double highest, Angle start) {
  std::vector<RigDirection> directions;
  for (const Vec3<double>& d : fibonacciSphere(static_cast<size_t>(count), lowest, highest, start))
    directions.push_back(normalized(RigDirection(d.x(), d.y(), d.z())));
  return directions;
}

capture::Camera<AcquisitionSpace> cameraAbout(const Point3<AcquisitionSpace, double>& center,
                                              const RigDirection& direction, double distance,
                                              const capture::Lens& lens) {
  const Vec3<double> back = direction.raw();
  const bool isUpright = std::abs(back.z()) > 1 - 1e-9;
  const Vec3<double> up = isUpright ? Vec3<double>::UnitY() : Vec3<double>::UnitZ();
  const Vec3<double> right = up.cross(back).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  return {lens, {rotation, -(rotation * (center.raw() + distance * back))}};
}

} // namespace surflect::stage
