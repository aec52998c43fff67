#include "render/film/shot_renderer.h"

#include "render/film/frame_file.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

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

// Multiplies colours, and the errors predicted of them, by 2^stops; exactly so where stops are whole.
void expose(method::FrameLayers& layers, double stops) {
  const auto factor = static_cast<float>(std::exp2(stops));
  for (size_t i = 0; i < layers.color.values.size(); i += 4)
    for (size_t c = 0; c < 3; ++c) layers.color.values[i + c] *= factor;
  if (const auto error = layers.aovs.find("predicted_error"); error != layers.aovs.end())
    for (float& value : error->second.values) value *= factor;
}

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
      if (view.identity == named->from) return fitted(scene::inObjectSpace(view.camera), script);
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
  const std::optional<double> stops = scene::exposureAt(script_, scene::shotTime(script_, frame));
  method::FrameLayers layers = withScene(frame, scale, [&](const scene::Scene& scene) {
    return renderer_.render(scene, aovs, progress_, std::exchange(memory_, {}));
  });
  if (stops) expose(layers, *stops);
  return layers;
}

method::PhotographBlend ShotRenderer::blendedAt(int frame, double scale, capture::Pixel pixel) {
  return withScene(frame, scale,
                   [&](const scene::Scene& scene) { return renderer_.blendedAt(scene, pixel, progress_); });
}

double ShotRenderer::previewExposure() {
  if (script_.exposure) return 1;
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
