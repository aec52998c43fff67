#include "render/lightfield/common/light_field_renderer.h"

#include "surfel/base/error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
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
  if (scene.ground)
    throw Error("a light field has its light baked in: it casts no shadow on a ground").at("ground");
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

constexpr const char *kDepth = "depth", *kPosition = "position", *kRest = "rest";

} // namespace

image::Image surfacePoints(const capture::Camera<AcquisitionSpace>& camera, const image::Image& depth,
                           const image::Image& color) {
  assert(depth.width == color.width && depth.height == color.height && depth.channels == 1);
  const auto acquisitionFromCamera = camera.cameraFromWorld.inverse();
  image::Image points(depth.width, depth.height, 3);
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      const double d = depth.at(x, y)[0];
      const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
      if (!ray || !std::isfinite(d)) continue;
      const double length = (-d - ray->origin.z()) / ray->direction.z();
      const auto point = acquisitionFromCamera(ray->origin + length * ray->direction);
      Eigen::Map<Vec3<float>>(points.at(x, y).data()) = color.at(x, y)[3] * point.raw().cast<float>();
    }
  });
  return points;
}

LightFieldRenderer::LightFieldRenderer(Parts parts, const method::Setting& setting)
    : parts_(std::move(parts)), identity_(parts_.description.identity) {
  parts_.description.isBaked = true;
  if (std::vector<std::string>& aovs = parts_.description.aovs; isAsked(aovs, kDepth))
    aovs.insert(aovs.end(), {kPosition, kRest});
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
  const capture::Camera<AcquisitionSpace> camera{scene.camera.lens, {pose.rotation(), pose.translation()}};
  const std::array<const char*, 2> places{kPosition, kRest};
  const bool asksPlaces = std::ranges::any_of(places, [&](const char* name) { return isAsked(aovs, name); });
  std::vector<std::string> drawn = aovs;
  if (asksPlaces && !isAsked(aovs, kDepth)) drawn.emplace_back(kDepth);
  parts_.draw(camera, drawn, progress, memory);
  if (const auto depth = memory.aovs.find(kDepth); asksPlaces && depth != memory.aovs.end()) {
    progress.checkpoint();
    const image::Image points = surfacePoints(camera, depth->second, memory.color);
    for (const char* name : places)
      if (isAsked(aovs, name)) memory.aovs[name] = points;
    if (!isAsked(aovs, kDepth)) memory.aovs.erase(depth);
  }
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
