#include "render/lightfield/traced/traced_images.h"

#include "render/stage/stage_plan.h"
#include "render/stage/stage_scene.h"
#include "render/stage/tracer.h"
#include "srf/image/half_float.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace surflect::traced {

namespace {

using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

constexpr double kStart = 0.75; // height from which rays start, just outside the sphere

// Camera whose pixels are the texels of the image: it looks along -d, and its picture is as wide as the
// sphere.
capture::Camera<AcquisitionSpace> cameraOf(const spherical::Sphere& sphere, const spherical::ImageAxes& axes,
                                           int size) {
  capture::Camera<AcquisitionSpace> camera;
  const double pixelsPerUnit = size / (2 * sphere.radius);
  camera.lens = {
      capture::Lens::Model::orthographic, size, size, pixelsPerUnit, pixelsPerUnit, size / 2., size / 2.};
  Mat3<double> rotation;
  rotation << axes.u.transpose(), axes.v.transpose(), axes.d.transpose();
  const Vec3<double> start = spherical::pointOf(sphere, axes, {0.5, 0.5, kStart});
  camera.cameraFromWorld = {rotation, Vec3<double>(-(rotation * start))};
  return camera;
}

// Radiance times alpha under all lights together, and alpha.
spherical::Texel texelOf(const stage::TracedView& view, size_t pixel) {
  const float alpha = view.alpha.values[pixel];
  spherical::Texel texel{};
  for (size_t channel = 0; channel < 3; ++channel) {
    double sum = 0;
    for (const image::Image& radiance : view.radiance) sum += radiance.values[3 * pixel + channel];
    texel[channel] = image::finiteHalf(static_cast<float>(sum * alpha));
  }
  texel[3] = image::nearestHalf(alpha);
  return texel;
}

// The training views, once each, under the light that is baked in: the only light, or several as fixed light.
capture::Capture viewsOf(const stage::StagePlan& plan) {
  capture::Capture views = plan.capture;
  if (views.lights.size() == 1) return views;
  views.lights.clear();
  const auto isSameView = [](const capture::Frame& a, const capture::Frame& b) { return a.view == b.view; };
  const auto repeated = std::ranges::unique(views.frames, isSameView); // frames of a view are contiguous
  views.frames.erase(repeated.begin(), repeated.end());
  for (capture::Frame& frame : views.frames) frame.light.reset();
  return views;
}

spherical::ResampledImage tracedImage(const stage::StageScene& scene, const stage::Stage& stage,
                                      std::span<const capture::Light> lights, const spherical::Sphere& sphere,
                                      const Vec3<double>& direction, int size, const Progress& progress) {
  const spherical::ImageAxes axes = spherical::axesOf(direction);
  const std::array<double, 3> key = {direction[0], direction[1], direction[2]};
  const stage::TracedView view =
      stage::traceView(scene, cameraOf(sphere, axes, size), contentHash(std::as_bytes(std::span(key))),
                       lights, stage.trace, progress);
  spherical::ResampledImage result;
  std::vector<float> heights(view.alpha.values.size());
  std::vector<bool> isOnObject(heights.size());
  for (size_t texel = 0; texel < heights.size(); ++texel) {
    result.colors.push_back(texelOf(view, texel));
    const auto column = static_cast<double>(texel % static_cast<size_t>(size)),
               row = static_cast<double>(texel / static_cast<size_t>(size));
    const Vec3<double> start =
        spherical::pointOf(sphere, axes, {(column + 0.5) / size, (row + 0.5) / size, kStart});
    const auto hit = scene.firstHit(assume<Point>(start), assume<Direction>(Vec3<double>(-direction)));
    isOnObject[texel] = hit.has_value();
    if (hit) heights[texel] = static_cast<float>(kStart - hit->distance / (2 * sphere.radius));
  }
  result.seen = static_cast<size_t>(std::ranges::count(isOnObject, true));
  result.heights = spherical::continuedHeights(heights, isOnObject, size);
  return result;
}

} // namespace

spherical::BuildReport build(const stage::Stage& stage, const spherical::BuildOptions& options,
                             const std::filesystem::path& folder, const Progress& progress) {
  if (stage.exposure) throw Error("light fields have no brackets").at("exposure").at(stage.file.string());
  const stage::StagePlan plan = stage::planOf(stage, stage::StageFrames::training);
  const stage::StageScene scene(stage.objects);
  return spherical::build(
      viewsOf(plan), stage::meshOf(stage.objects),
      [&](const spherical::Sphere& sphere, const Vec3<double>& direction, int size) {
        return tracedImage(scene, stage, plan.capture.lights, sphere, direction, size, progress);
      },
      options, folder, progress);
}

} // namespace surflect::traced
