#include "render/lightfield/common/light_field_renderer.h"

#include "render/lightfield/common/baked_scene.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <utility>

namespace surflect::lightfield {

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
