#include "tests/srf/proxy/hull/shapes.h"

#include <algorithm>

namespace surflect::hull::shapes {
namespace {

bool meets(const std::vector<Sphere>& spheres, const Vec3<double>& origin, const Vec3<double>& direction) {
  return std::ranges::any_of(spheres, [&](const Sphere& s) {
    const Vec3<double> toCenter = s.center - origin;
    return (toCenter - toCenter.dot(direction) * direction).squaredNorm() < s.radius * s.radius;
  });
}

} // namespace

image::Image matte(const capture::Camera<AcquisitionSpace>& camera, const std::vector<Sphere>& spheres,
                   int samples) {
  image::Image alpha(camera.lens.width, camera.lens.height, 1);
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  for (int y = 0; y < alpha.height; ++y)
    for (int x = 0; x < alpha.width; ++x)
      for (int s = 0; s < samples * samples; ++s)
        if (const auto ray = capture::rayThrough(
                camera.lens, {x + (s % samples + 0.5) / samples, y + (s / samples + 0.5) / samples}))
          alpha.at(x, y)[0] +=
              meets(spheres, worldFromCamera(ray->origin).raw(), worldFromCamera(ray->direction).raw())
                  ? 1.f / static_cast<float>(samples * samples)
                  : 0.f;
  return alpha;
}

} // namespace surflect::hull::shapes
