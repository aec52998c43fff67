// Small stages for tests.
#pragma once

#include "render/stage/shapes.h"
#include "render/stage/tracer.h"

#include <random>

namespace surflect {

using StagePoint = Point3<AcquisitionSpace, double>;
using StageDirection = Direction3<AcquisitionSpace, double>;

inline const Rgb kAlbedo{0.8f, 0.4f, 0.2f};

inline StageDirection unit(double x, double y, double z) { return normalized(StageDirection(x, y, z)); }

inline StageDirection randomUnit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return unit(x, y, z);
}

// Stands in direction `from` of the origin, `distance` away, and looks at it; z is up.
inline Camera<AcquisitionSpace> lookFrom(const StageDirection& from, double distance, int size, double focal,
                                         Lens::Model model = Lens::Model::pinhole) {
  const Vec3<double> back = from.raw(), right = Vec3<double>::UnitZ().cross(back).normalized();
  Camera<AcquisitionSpace> camera;
  camera.lens = {model, size, size, focal, focal, size / 2., size / 2., 0, 0, 0, 0};
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  camera.cameraFromWorld = {rotation, Vec3<double>(0, 0, -distance)};
  return camera;
}

inline Light sun(const StageDirection& towards, const Rgb& irradiance = {3, 3, 3}) {
  return {"sun", "sun", DirectionalLight{towards, irradiance}};
}

inline std::vector<StageObject> oneObject(Surface surface, const Material& material) {
  std::vector<StageObject> objects;
  objects.push_back({std::move(surface), material});
  return objects;
}

inline double sum(const Image& image) {
  double total = 0;
  for (const float value : image.values) total += value;
  return total;
}

} // namespace surflect
