#include "bench/doll/doll_shot.h"

#include "render/surfels/surfel_method.h"
#include "surfel/math/bounds.h"
#include "surfel/math/sphere_sampling.h"

#include <algorithm>

namespace surflect::bench {

capture::Camera<ObjectSpace> frontCamera(const SurfelCloud& cloud, int width, int height) {
  const Eigen::AlignedBox3d box = boundsOf(cloud.p0);
  const double side = box.sizes().maxCoeff(), distance = 4 * side;
  capture::Camera<ObjectSpace> camera;
  capture::Lens& lens = camera.lens;
  lens.width = width;
  lens.height = height;
  lens.focalX = lens.focalY = 0.5 * std::min(width, height) * distance / (0.56 * side);
  lens.centerX = 0.5 * width;
  lens.centerY = 0.5 * height;
  const Vec3<double> backwards = Vec3<double>(0.35, -1, 0.25).normalized();
  const Vec3<double> right = Vec3<double>(0, 0, 1).cross(backwards).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), backwards.cross(right).transpose(), backwards.transpose();
  camera.cameraFromWorld = {rotation, -rotation * (box.center() + distance * backwards)};
  return camera;
}

Shot dollShot(const SurfelCloud& cloud, int width, int height, size_t lights) {
  const Eigen::AlignedBox3d box = boundsOf(cloud.p0);
  const Vec3<double> middle = box.center();
  const double side = box.sizes().maxCoeff(), reach = 2.5 * side;
  Shot shot;
  shot.warp = warp::twistWarp({0, 0, 1}, Angle::fromDegrees(40 / side), middle);
  shot.camera = frontCamera(cloud, width, height);
  const auto strength = static_cast<float>(1.5 * reach * reach / static_cast<double>(lights));
  for (const Vec3<double>& towards : fibonacciSphere(lights, -0.2, 1)) {
    scene::ShotPointLight light;
    light.position = assume<Point3<ObjectSpace, double>>(middle + reach * towards);
    const Vec3<double> color = (Vec3<double>::Ones() + 0.5 * towards) * strength;
    light.intensity = {static_cast<float>(color[0]), static_cast<float>(color[1]),
                       static_cast<float>(color[2])};
    shot.lights.emplace_back(light);
  }
  shot.options.shade.cameras = 4;
  shot.options.shade.lights = 4;
  shot.options.shade.lightFit = weights::LightFit::mean;
  shot.options.shade.foreshortened = false;
  return shot;
}

Shot previewOf(Shot shot) {
  const method::Method& surfels = surfels::surfelMethod();
  const surfels::FrameOptions preview =
      surfels::frameOptions(method::settingOf(method::Preset::preview, surfels.renderOptions));
  shot.options.shade.weightError = preview.shade.weightError;
  shot.options.environmentError = preview.environmentError;
  shot.options.splats.searchLayers = preview.splats.searchLayers;
  shot.options.surfelSize = preview.surfelSize;
  shot.options.surfelsPerQuery = preview.surfelsPerQuery;
  return shot;
}

model::Model everyView(const model::Model& model, size_t step) {
  model::Model part;
  part.folder = model.folder;
  part.rig = model.rig;
  part.cloud = model.cloud;
  part.levels = model.levels;
  part.middle = model.middle;
  part.white = model.white;
  part.tolerance = model.tolerance;
  part.lightBlend = model.lightBlend;
  part.isFullProduct = model.isFullProduct;
  part.hasNearPairs = model.hasNearPairs;
  part.rig.views.clear();
  for (size_t view = 0; view < model.rig.views.size(); view += step) {
    part.rig.views.push_back(model.rig.views[view]);
    part.files.emplace_back(model.files[view].path());
    part.columns.push_back(model.columns[view]);
  }
  std::erase_if(part.rig.frames, [&](const capture::Frame& frame) { return frame.view % step != 0; });
  for (capture::Frame& frame : part.rig.frames) frame.view /= step;
  part.visibility.views = part.rig.views.size();
  for (size_t surfel = 0; surfel < model.cloud.size(); ++surfel)
    for (size_t view = 0; view < model.rig.views.size(); view += step)
      part.visibility.values.push_back(model.visibility.of(surfel)[view]);
  return part;
}

} // namespace surflect::bench
