#include "render/surfels/outgoing_radiance.h"

#include "render/surfels/queries.h"
#include "surfel/base/text.h"
#include "warp/deform.h"

#include <algorithm>

namespace surflect::surfels {

namespace {

// A camera that sees everything from one direction.
capture::Camera<ObjectSpace> distantCamera(const Direction3<ObjectSpace, double>& viewer) {
  capture::Camera<ObjectSpace> camera;
  camera.lens.model = capture::Lens::Model::orthographic;
  camera.cameraFromWorld = {
      Eigen::Quaterniond::FromTwoVectors(viewer.raw(), Vec3<double>::UnitZ()).toRotationMatrix(),
      Vec3<double>::Zero()};
  return camera;
}

} // namespace

DrawnSurfels drawnSurfels(const weights::ReflectanceField& field, size_t most, const Progress& progress) {
  const SurfelCloud& whole = field.cloud;
  const bool areAllOnObject = std::ranges::none_of(whole.coverage, [](float peak) { return peak == 0; });
  if (areAllOnObject && whole.size() <= most) return {whole, upTo(whole.size())};
  const LevelsOfDetail levels = field.levels ? *field.levels : levelsOfDetail(whole, progress);
  const size_t level = finestLevel(levels, most);
  DrawnSurfels drawn;
  for (uint32_t i = 0; i < whole.size(); ++i)
    if (levels.of(i).size() > level && whole.coverage[i] > 0) drawn.surfels.push_back(i);
  drawn.cloud = subsetOf(whole, drawn.surfels);
  for (size_t i = 0; i < drawn.surfels.size(); ++i) {
    const DetailSplat& splat = levels.of(drawn.surfels[i])[level];
    drawn.cloud.radius[i] = splat.radius;
    drawn.cloud.coverage[i] = splat.coverage;
  }
  return drawn;
}

OutgoingRadiance::OutgoingRadiance(const weights::ReflectanceField& field, const DrawnSurfels& drawn,
                                   const scene::Scene& scene, const FrameOptions& options,
                                   FrameWorkspace& workspace, const Progress& progress)
    : field_(field), drawn_(drawn), options_(options), workspace_(workspace), scene_(scene),
      deformed_(warp::deform(drawn.cloud, scene.warp, progress)) {}

std::unique_ptr<OutgoingRadiance::Light> OutgoingRadiance::lightOf(const Progress& progress) const {
  std::unique_ptr<Light> light(new Light{
      litScene(scene_, options_.environmentError, field_, options_.shade, workspace_.environments, progress),
      withTangents(options_.tangents, deformed_, field_, drawn_.surfels, progress),
      {}});
  const bool hasLights = light->lit.scene.lights.size() > light->lit.environments.size();
  if (!castsShadows(field_, options_.shade, options_.shadows) || !hasLights) return light;
  if (!workspace_.occluders) workspace_.occluders = occludersOf(field_.cloud, *field_.levels);
  light->shadows.emplace(*workspace_.occluders, field_.cloud, light->lit.scene, progress);
  return light;
}

shading::Shaded OutgoingRadiance::towards(const Direction3<ObjectSpace, double>& viewer,
                                          std::span<const uint32_t> surfels, const Progress& progress) const {
  const capture::Camera<ObjectSpace> camera = distantCamera(viewer);
  if (!light_) light_ = lightOf(progress);
  const auto& [lit, tangents, shadows] = *light_;
  const DeformedCloud& forLookUp = tangents.size() > 0 ? tangents : deformed_;
  const shading::FillBatch fill = [&](size_t begin, size_t end, weights::QueryBatch& batch) {
    const auto part = surfels.subspan(begin, end - begin);
    writeQueries(drawn_.cloud, forLookUp, part, camera, lit.scene.lights, lit.environments, progress, batch);
    batch.reached.clear();
    if (shadows) shadows->fill(deformed_, part, batch);
    for (uint32_t& surfel : batch.surfels) surfel = drawn_.surfels[surfel]; // its number in the field
  };
  weights::ShadeOptions shading = options_.shade;
  shading.placesPerQuery = 1;
  shading.showsBlends = false;
  shading::ShadingStats stats;
  return shading::shade(field_, surfels.size(), fill, shading, workspace_.cache, stats, progress);
}

} // namespace surflect::surfels
