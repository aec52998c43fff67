#include "render/lightfield/common/light_field_renderer.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <utility>
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

namespace {

// Whether any pixel of an RGBA picture is covered.
bool showsObject(const image::Image& picture) {
  for (size_t i = 3; i < picture.values.size(); i += 4)
    if (picture.values[i] > 0) return true;
  return false;
}

} // namespace

LightFieldRenderer::LightFieldRenderer(Parts parts, const method::Setting& setting)
    : parts_(std::move(parts)), identity_(parts_.description.identity) {
  parts_.description.isBaked = true;
  set(method::forFrames(parts_.options, setting));
}

void LightFieldRenderer::configure(const method::Setting& setting) {
  parts_.configure(setting);
  parts_.description.identity =
      identity_ + " " + method::textOf(method::withoutDefaults(parts_.options, setting));
}

method::FrameLayers LightFieldRenderer::render(const scene::Scene& scene,
                                               const std::vector<std::string>& aovs, const Progress& progress,
                                               method::FrameLayers memory) {
  progress.checkpoint();
  requireBaked(scene, parts_.description.rig, parts_.description.points);
  // Nothing is warped: object space is acquisition space.
  const auto& pose = scene.camera.cameraFromWorld;
  memory.aovs.clear();
  memory.report = {};
  parts_.draw({scene.camera.lens, {pose.rotation(), pose.translation()}}, aovs, progress, memory);
  if (!showsObject(memory.color)) memory.report.remark = "no part of the object is visible";
  return memory;
}

bool isAsked(const std::vector<std::string>& aovs, std::string_view name) {
  return std::ranges::find(aovs, name) != aovs.end();
}

capture::Camera<AcquisitionSpace> sampled(const capture::Camera<AcquisitionSpace>& camera, int samples) {
  return {capture::resized(camera.lens, samples * camera.lens.width, samples * camera.lens.height),
          camera.cameraFromWorld};
}

double samplesOf(const capture::Camera<AcquisitionSpace>& camera, int samples) {
  return static_cast<double>(camera.lens.width) * camera.lens.height * samples * samples;
}

} // namespace surflect::lightfield
