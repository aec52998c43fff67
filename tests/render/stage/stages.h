// Small stages for tests.
#pragma once

#include "render/stage/shapes.h"
#include "render/stage/tracer.h"
#include "tests/support/random.h"
#include "tests/support/text.h"

#include <string>

namespace surflect::stage {

using StagePoint = Point3<AcquisitionSpace, double>;
using StageDirection = Direction3<AcquisitionSpace, double>;

inline const Rgb kAlbedo{0.8f, 0.4f, 0.2f};

inline StageDirection unit(double x, double y, double z) { return normalized(StageDirection(x, y, z)); }

inline StageDirection randomDirection(std::mt19937& random) {
  return assume<StageDirection>(randomUnit(random));
}

// Stands in direction `from` of the origin, `distance` away, and looks at it; z is up.
inline capture::Camera<AcquisitionSpace>
setPlaces(const StageDirection& from, double distance, int size, double focal,
          capture::Lens::Model model = capture::Lens::Model::pinhole) {
  const Vec3<double> back = from.raw(), right = Vec3<double>::UnitZ().cross(back).normalized();
  capture::Camera<AcquisitionSpace> camera;
  camera.lens = {model, size, size, focal, focal, size / 2., size / 2., 0, 0, 0, 0};
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  camera.cameraFromWorld = {rotation, Vec3<double>(0, 0, -distance)};
  return camera;
}

inline capture::Light sun(const StageDirection& towards, const Rgb& irradiance = {3, 3, 3}) {
  return {"sun", "sun", capture::DirectionalLight{towards, irradiance}};
}

inline std::vector<StageObject> oneObject(Surface surface, const material::Material& material) {
  std::vector<StageObject> objects;
  objects.push_back({std::move(surface), material});
  return objects;
}

// (a, b, a x b) is right-handed: a x b points out of the quadrangle.
inline Surface quad(const Vec3<double>& corner, const Vec3<double>& a, const Vec3<double>& b) {
  Surface surface;
  for (const Vec3<double>& p :
       {corner, Vec3<double>(corner + a), Vec3<double>(corner + a + b), Vec3<double>(corner + b)}) {
    surface.mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p));
    surface.normals.push_back(assume<StageDirection>(a.cross(b).normalized()));
    surface.tangents.push_back(assume<StageDirection>(a.normalized()));
  }
  surface.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return surface;
}

// A stage file: a ball on a slab. The arguments are what the tables hold.
inline std::string ballOnSlab(int samples, const std::string& camera, const std::string& views,
                              const std::string& lights) {
  return "samples = " + std::to_string(samples) +
         "\n[camera]\nmodel = \"pinhole\"\ndistance = 4\nfov_deg = 35\n" + camera + "\n[views]\n" + views +
         "\n[lights]\n" + lights + R"toml(
[[material]]
name = "clay"
type = "lambert"
albedo = [0.8, 0.4, 0.2]
[[object]]
type = "sphere"
material = "clay"
radius = 0.7
segments = 32
[[object]]
type = "box"
material = "clay"
center = [0, 0, -0.8]
size = [1, 1, 0.2]
segments = 4
)toml";
}

inline double sum(const image::Image& image) {
  double total = 0;
  for (const float value : image.values) total += value;
  return total;
}

} // namespace surflect::stage
