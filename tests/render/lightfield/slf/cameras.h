// Cameras around a synthetic field.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/math/space.h"
#include "tests/support/random.h"

#include <random>

namespace surflect::slf {

using Camera = capture::Camera<AcquisitionSpace>;

// Looks along a direction from a place; `focal` is in pixels.
inline Camera cameraAt(const Vec3<double>& place, const Vec3<double>& forwards, int width, int height,
                       double focal) {
  Mat3<double> rotation;
  const Vec3<double> z = -forwards.normalized(), x = z.unitOrthogonal();
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  Camera camera;
  camera.lens.width = width;
  camera.lens.height = height;
  camera.lens.focalX = camera.lens.focalY = focal;
  camera.lens.centerX = width / 2.0;
  camera.lens.centerY = height / 2.0;
  camera.cameraFromWorld = {rotation, -rotation * place};
  return camera;
}

// At 2 to 4 radii from the middle of a sphere of radius 1, looking nearly at it, which fills most of the
// picture.
inline Camera randomCamera(std::mt19937& random, int width, int height,
                           const Vec3<double>& middle = {0, 0, 0}) {
  std::uniform_real_distribution<double> distance(2, 4);
  const Vec3<double> towards = randomUnit(random), aside = randomUnit(random);
  const double d = distance(random);
  return cameraAt(middle + d * towards, 0.2 * aside - d * towards, width, height, 0.4 * height * d);
}

} // namespace surflect::slf
