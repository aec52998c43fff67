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
  if (whole.size() <= most) return {whole, upTo(whole.size())};
  const LevelsOfDetail levels = field.levels ? *field.levels : levelsOfDetail(whole, progress);
  const size_t level = finestLevel(levels, most);
  DrawnSurfels drawn;
  for (uint32_t i = 0; i < whole.size(); ++i)
    if (levels.of(i).size() > level) drawn.surfels.push_back(i);
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
    : field_(field), drawn_(drawn), options_(options), workspace_(workspace),
      lit_(litScene(scene, options.environmentError, field, options.shade, workspace.environments, progress)),
      deformed_(warp::deform(drawn.cloud, scene.warp, progress)),
      tangents_(withTangents(options.tangents, deformed_, field, drawn.surfels, progress)) {
  const bool hasLights = lit_.scene.lights.size() > lit_.environments.size();
  if (!castsShadows(field, options.shade, options.shadows) || !hasLights) return;
  if (!workspace.occluders) workspace.occluders = occludersOf(field.cloud, *field.levels);
  shadows_.emplace(*workspace.occluders, field.cloud, lit_.scene, progress);
}

shading::Shaded OutgoingRadiance::towards(const Direction3<ObjectSpace, double>& viewer,
                                          std::span<const uint32_t> surfels, const Progress& progress) const {
  const capture::Camera<ObjectSpace> camera = distantCamera(viewer);
  const DeformedCloud& forLookUp = tangents_.size() > 0 ? tangents_ : deformed_;
  const shading::FillBatch fill = [&](size_t begin, size_t end, weights::QueryBatch& batch) {
    const auto part = surfels.subspan(begin, end - begin);
    writeQueries(drawn_.cloud, forLookUp, part, camera, lit_.scene.lights, lit_.environments, progress,
                 batch);
    batch.reached.clear();
    if (shadows_) shadows_->fill(deformed_, part, batch);
    for (uint32_t& surfel : batch.surfels) surfel = drawn_.surfels[surfel]; // its number in the field
  };
  weights::ShadeOptions shading = options_.shade;
  shading.placesPerQuery = 1;
  shading.showsBlends = false;
  shading::ShadingStats stats;
  return shading::shade(field_, surfels.size(), fill, shading, workspace_.cache, stats, progress);
}

} // namespace surflect::surfels
