#include "render/film/shot_renderer.h"

#include "render/film/frame_file.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <algorithm>
#include <cmath>

namespace surflect::film {

namespace {

capture::Lens scaled(const capture::Lens& lens, double scale) {
  const auto side = [&](int pixels) { return std::max(1, static_cast<int>(std::lround(pixels * scale))); };
  return capture::resized(lens, side(lens.width), side(lens.height));
}

capture::Camera<ObjectSpace> shotCamera(const scene::Script& script, const method::Description& model,
                                        std::span<const capture::View> others, const warp::ShotTime& time) {
  const auto* named = std::get_if<scene::NamedCamera>(&*script.camera);
  if (!named) return scene::cameraAt(script, time);
  std::vector<std::string_view> known;
  for (const std::span<const capture::View> views : {std::span(model.rig.views), others})
    for (const capture::View& view : views) {
      if (view.identity == named->from)
        return {scene::fittedLens(view.camera.lens, script, "the camera's pictures"),
                scene::inObjectSpace(view.camera).cameraFromWorld};
      known.push_back(view.identity);
    }
  throw Error::mismatch("a camera of " + model.folder.string() + didYouMean(named->from, known),
                        "'" + named->from + "'")
      .at("camera.from")
      .in(script.path);
}

} // namespace

ShotRenderer::ShotRenderer(const scene::Script& script, method::Renderer& renderer,
                           std::vector<scene::Environment> environments, const Progress& progress,
                           std::vector<capture::View> others)
    : script_(script), renderer_(renderer), environments_(std::move(environments)), progress_(progress),
      others_(std::move(others)) {
  size_t read = 0;
  for (const scene::LightMotion& motion : script.lights) {
    const auto* light = std::get_if<scene::EnvironmentLightMotion>(&motion);
    if (!light) continue;
    scene::ShotEnvironment environment;
    environment.map = environments_[read++].map;
    environment.error = light->error;
    environment.extrapolation = light->extrapolation;
    environmentReports_.push_back(renderer.prepare(environment, progress));
  }
}

capture::Camera<ObjectSpace> ShotRenderer::camera(int frame, double scale) const {
  capture::Camera<ObjectSpace> camera =
      shotCamera(script_, renderer_.describe(), others_, scene::shotTime(script_, frame));
  camera.lens = scaled(camera.lens, scale);
  return camera;
}

method::FrameLayers ShotRenderer::render(int frame, double scale) {
  return render(frame, scale, script_.output->aov);
}

template <class Ask> auto ShotRenderer::withScene(int frame, double scale, const Ask& ask) const {
  const warp::ShotTime time = scene::shotTime(script_, frame);
  const warp::WarpPointer warp = scene::warpAt(script_, time);
  return ask(scene::Scene{*warp, camera(frame, scale), scene::lightsAt(script_, time, environments_)});
}

method::FrameLayers ShotRenderer::render(int frame, double scale, const std::vector<std::string>& aovs) {
  return withScene(frame, scale, [&](const scene::Scene& scene) {
    return renderer_.render(scene, aovs, progress_, std::exchange(memory_, {}));
  });
}

method::FrameLayers ShotRenderer::renderAlbedo(int frame, double scale) {
  if (!white_) {
    image::Image radiance(2, 1, 3);
    std::ranges::fill(radiance.values, 1.f);
    white_ = std::make_shared<const weights::EnvironmentMap>(
        weights::environmentOf(radiance, weights::EnvironmentMapping::latLong, progress_));
  }
  return withScene(frame, scale, [&](scene::Scene scene) {
    scene::ShotEnvironment environment;
    environment.map = white_;
    scene.lights = {environment};
    return renderer_.render(scene, {}, progress_);
  });
}

method::PhotographBlend ShotRenderer::blendedAt(int frame, double scale, capture::Pixel pixel) {
  return withScene(frame, scale,
                   [&](const scene::Scene& scene) { return renderer_.blendedAt(scene, pixel, progress_); });
}

double ShotRenderer::previewExposure() {
  if (!exposure_) {
    double white = 0;
    const scene::Frames& frames = *script_.frames;
    const int count = std::min(5, frames.count());
    for (int i = 0; i < count; ++i) {
      const int frame = frames.first + (frames.count() - 1) * i / std::max(1, count - 1);
      white = std::max(white, whiteOf(render(frame, 0.25, {}).color));
    }
    exposure_ = white > 0 ? 1 / white : 1;
  }
  return *exposure_;
}

} // namespace surflect::film
