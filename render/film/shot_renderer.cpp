#include "render/film/shot_renderer.h"

#include "render/film/frame_file.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>

namespace surflect {

namespace {

std::string sizeOf(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

// A captured camera on a picture of the script's size.
Camera<ObjectSpace> fitted(Camera<ObjectSpace> camera, const Script& script) {
  const Output& output = *script.output;
  const Lens& lens = camera.lens;
  if (std::abs(output.width * lens.height - output.height * lens.width) > std::max(output.width, lens.width))
    throw Error::mismatch("the shape of the camera's pictures, " + sizeOf(lens.width, lens.height),
                          sizeOf(output.width, output.height))
        .at("output.size")
        .in(script.path);
  camera.lens = resized(lens, output.width, output.height);
  return camera;
}

Lens scaled(const Lens& lens, double scale) {
  const auto side = [&](int pixels) { return std::max(1, static_cast<int>(std::lround(pixels * scale))); };
  return resized(lens, side(lens.width), side(lens.height));
}

Camera<ObjectSpace> shotCamera(const Script& script, const Model& model, const ShotTime& time) {
  const auto* named = std::get_if<NamedCamera>(&*script.camera);
  if (!named) return cameraAt(script, time);
  for (const auto& view : model.rig.views)
    if (view.identity == named->from) return fitted(inObjectSpace(view.camera), script);
  throw Error::mismatch("a camera of " + model.folder.string(), "'" + named->from + "'")
      .at("camera.from")
      .in(script.path);
}

} // namespace

ShotRenderer::ShotRenderer(const Script& script, const Model& model, const FrameOptions& options,
                           size_t cacheBytes, const Progress& progress)
    : script_(script), model_(model), options_(options),
      environments_(prepareEnvironments(script, model, options.shade, progress)), progress_(progress),
      cache_(model.files, cacheBytes) {}

Camera<ObjectSpace> ShotRenderer::camera(int frame, double scale) const {
  Camera<ObjectSpace> camera = shotCamera(script_, model_, shotTime(script_, frame));
  camera.lens = scaled(camera.lens, scale);
  return camera;
}

FrameLayers ShotRenderer::render(int frame, double scale, FrameStats& stats) {
  return render(frame, scale, script_.output->aov, stats);
}

FrameLayers ShotRenderer::render(int frame, double scale, const std::vector<std::string>& aovs, FrameStats& stats) {
  const ShotTime time = shotTime(script_, frame);
  FrameOptions options = options_;
  options.aovs = aovs;
  return renderFrame(model_, *warpAt(script_, time), camera(frame, scale),
                     lightsAt(script_, time, environments_), options, cache_, stats, progress_, &memory_);
}

double ShotRenderer::previewExposure() {
  if (!exposure_) {
    double white = 0;
    const Frames& frames = *script_.frames;
    const int count = std::min(5, frames.count());
    for (int i = 0; i < count; ++i) {
      FrameStats ignored;
      const int frame = frames.first + (frames.count() - 1) * i / std::max(1, count - 1);
      white = std::max(white, whiteOf(render(frame, 0.25, {}, ignored).color));
    }
    exposure_ = white > 0 ? 1 / white : 1;
  }
  return *exposure_;
}

} // namespace surflect
