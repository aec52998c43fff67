#include "render/lightfield/common/baked_scene.h"

#include "surfel/base/error.h"

#include <variant>

namespace surflect::lightfield {

namespace {

bool equal(const scene::ShotLight& a, const scene::ShotLight& b) {
  if (const auto* x = std::get_if<scene::ShotDirectionalLight>(&a),
      *y = std::get_if<scene::ShotDirectionalLight>(&b);
      x && y)
    return x->towards == y->towards && x->irradiance == y->irradiance &&
           x->irradianceGradient == y->irradianceGradient;
  if (const auto* x = std::get_if<scene::ShotPointLight>(&a), *y = std::get_if<scene::ShotPointLight>(&b);
      x && y)
    return x->position == y->position && x->intensity == y->intensity;
  return false;
}

} // namespace

void requireBaked(const scene::Scene& scene, const capture::Capture& rig,
                  std::span<const Point3<AcquisitionSpace>> points) {
  const bool isBaked = scene.lights.empty() || (scene.lights.size() == 1 && rig.lights.size() == 1 &&
                                                equal(scene.lights[0], scene::inObjectSpace(rig.lights[0])));
  if (!isBaked)
    throw Error(
        "a light field has its light baked in: the scene can have no light but that of the photographs")
        .at("light");
  for (const Point3<AcquisitionSpace>& point : points) {
    const Vec3<double> rest = point.raw().cast<double>();
    if (scene.warp.position(rest) != rest)
      throw Error("a light field cannot be bent: its light would stay as it was at rest").at("warp");
  }
}

} // namespace surflect::lightfield
