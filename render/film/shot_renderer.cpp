#include "render/film/shot_renderer.h"

#include "render/film/frame_file.h"
#include "surfel/base/error.h"
#include "surfel/base/message_text.h"

#include <algorithm>
#include <cmath>

namespace surflect::film {

namespace {

// A captured camera on a picture of the script's size.
capture::Camera<ObjectSpace> fitted(capture::Camera<ObjectSpace> camera, const scene::Script& script) {
  const scene::Output& output = *script.output;
  const capture::Lens& lens = camera.lens;
  if (std::abs(output.width * lens.height - output.height * lens.width) > std::max(output.width, lens.width))
    throw Error::mismatch("the shape of the camera's pictures, " + sizeText(lens.width, lens.height),
                          sizeText(output.width, output.height))
        .at("output.size")
        .in(script.path);
  camera.lens = capture::resized(lens, output.width, output.height);
  return camera;
}

capture::Lens scaled(const capture::Lens& lens, double scale) {
  const auto side = [&](int pixels) { return std::max(1, static_cast<int>(std::lround(pixels * scale))); };
  return capture::resized(lens, side(lens.width), side(lens.height));
}

capture::Camera<ObjectSpace> shotCamera(const scene::Script& script, const model::Model& model,
                                        const warp::ShotTime& time) {
  const auto* named = std::get_if<scene::NamedCamera>(&*script.camera);
  if (!named) return scene::cameraAt(script, time);
  for (const auto& view : model.rig.views)
    if (view.identity == named->from) return fitted(scene::inObjectSpace(view.camera), script);
  throw Error::mismatch("a camera of " + model.folder.string(), "'" + named->from + "'")
      .at("camera.from")
      .in(script.path);
}

} // namespace

ShotRenderer::ShotRenderer(const scene::Script& script, const model::Model& model,
                           const surfels::FrameOptions& options, size_t cacheBytes, const Progress& progress)
    : script_(script), model_(model), options_(options),
      environments_(scene::prepareEnvironments(script, model, options.shade, progress)), progress_(progress),
      cache_(model.files, cacheBytes) {}

capture::Camera<ObjectSpace> ShotRenderer::camera(int frame, double scale) const {
  capture::Camera<ObjectSpace> camera = shotCamera(script_, model_, scene::shotTime(script_, frame));
  camera.lens = scaled(camera.lens, scale);
  return camera;
}

surfels::FrameLayers ShotRenderer::render(int frame, double scale, surfels::FrameStats& stats) {
  return render(frame, scale, script_.output->aov, stats);
}

surfels::FrameLayers ShotRenderer::render(int frame, double scale, const std::vector<std::string>& aovs,
                                          surfels::FrameStats& stats) {
  const warp::ShotTime time = scene::shotTime(script_, frame);
  surfels::FrameOptions options = options_;
  options.aovs = aovs;
  return surfels::renderFrame(model_, *scene::warpAt(script_, time), camera(frame, scale),
                              scene::lightsAt(script_, time, environments_), options, cache_, stats,
                              progress_, &memory_);
}

double ShotRenderer::previewExposure() {
  if (!exposure_) {
    double white = 0;
    const scene::Frames& frames = *script_.frames;
    const int count = std::min(5, frames.count());
    for (int i = 0; i < count; ++i) {
      surfels::FrameStats ignored;
      const int frame = frames.first + (frames.count() - 1) * i / std::max(1, count - 1);
      white = std::max(white, whiteOf(render(frame, 0.25, {}, ignored).color));
    }
    exposure_ = white > 0 ? 1 / white : 1;
  }
  return *exposure_;
}

} // namespace surflect::film
