#include "render/film/shot_renderer.h"

#include "render/film/frame_file.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace surflect::film {

namespace {

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

constexpr const char* kDepth = "depth";
constexpr float kLargestHalf = 65504;

// Adds the report of a further picture of a frame: amounts add up, states are those of the last picture.
void addReport(method::FrameReport& sum, const method::FrameReport& report) {
  constexpr std::array<std::string_view, 3> kStates = {"level", "mean_rank", "texture_bytes"};
  for (const auto& [stage, seconds] : report.seconds) sum.seconds[stage] += seconds;
  for (const auto& [stage, seconds] : report.processorSeconds) sum.processorSeconds[stage] += seconds;
  for (const auto& [name, count] : report.counts) {
    double& total = sum.counts[name];
    total = std::ranges::count(kStates, name) > 0 ? count : total + count;
  }
  if (!sum.remark) sum.remark = report.remark;
}

// Sums of pictures of equal sizes. In double precision, up to 2^29 equal pictures have themselves as mean, to
// the bit.
class LayerSums {
public:
  void add(const method::FrameLayers& layers) {
    ++count_;
    add(layers.color, color_);
    add(layers.shadow, shadow_);
    for (const auto& [name, image] : layers.aovs) add(image, aovs_[name]);
    addReport(report_, layers.report);
  }
  // `last`, the layers that were added last, become the mean.
  method::FrameLayers mean(method::FrameLayers last) const {
    divide(color_, last.color);
    divide(shadow_, last.shadow);
    for (auto& [name, image] : last.aovs) divide(aovs_.at(name), image);
    last.report = report_;
    return last;
  }

private:
  static void add(const image::Image& image, std::vector<double>& sums) {
    if (sums.empty()) return sums.assign(image.values.begin(), image.values.end()); // keeps -0
    tbb::parallel_for(tbb::blocked_range<size_t>(0, sums.size(), 1 << 16), [&](const auto& range) {
      for (size_t i = range.begin(); i < range.end(); ++i) sums[i] += double{image.values[i]};
    });
  }
  void divide(const std::vector<double>& sums, image::Image& image) const {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, sums.size(), 1 << 16), [&](const auto& range) {
      for (size_t i = range.begin(); i < range.end(); ++i)
        image.values[i] = static_cast<float>(sums[i] / count_);
    });
  }

  double count_ = 0;
  std::vector<double> color_, shadow_;
  std::map<std::string, std::vector<double>> aovs_;
  method::FrameReport report_;
};

} // namespace

ShotRenderer::ShotRenderer(const scene::Script& script, method::Renderer& renderer,
                           std::vector<scene::Environment> environments, const Progress& progress,
                           std::vector<capture::View> others)
    : script_(script), renderer_(renderer), environments_(std::move(environments)), progress_(progress),
      others_(std::move(others)) {
  if (script.ground && renderer.describe().isBaked)
    throw Error("needs a model that is relit: the light of " + renderer.describe().folder.string() +
                " is fixed, and casts no shadow on a ground")
        .at("ground")
        .in(script.path);
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

capture::Camera<ObjectSpace> ShotRenderer::camera(double frame, double scale) const {
  capture::Camera<ObjectSpace> camera =
      shotCamera(script_, renderer_.describe(), others_, scene::shotTime(script_, frame));
  camera.lens = scaled(camera.lens, scale);
  return camera;
}

template <class Ask>
auto ShotRenderer::withScene(double frame, const capture::Camera<ObjectSpace>& camera, const Ask& ask) const {
  const warp::ShotTime time = scene::shotTime(script_, frame);
  const warp::WarpPointer warp = scene::warpAt(script_, time);
  return ask(scene::Scene{*warp, camera, scene::lightsAt(script_, time, environments_),
                          scene::groundAt(script_, time)});
}

method::FrameLayers ShotRenderer::picture(double frame, const capture::Camera<ObjectSpace>& camera,
                                          const std::vector<std::string>& aovs, bool hasGround) {
  return withScene(frame, camera, [&](scene::Scene scene) {
    if (!hasGround) scene.ground.reset();
    return renderer_.render(scene, aovs, progress_, std::exchange(memory_, {}));
  });
}

method::FrameLayers ShotRenderer::exposed(int frame, method::FrameLayers layers) const {
  if (const auto stops = scene::exposureAt(script_, scene::shotTime(script_, frame))) expose(layers, *stops);
  const auto tooBright = std::ranges::count_if(
      layers.color.values, [](float value) { return value > kLargestHalf && std::isfinite(value); });
  if (tooBright > 0 && !layers.report.remark)
    layers.report.remark =
        fmt::format("{} beyond {}, the most that an EXR of half floats holds, are clamped to it",
                    counted(static_cast<size_t>(tooBright), "colour value"), kLargestHalf);
  return layers;
}

method::FrameLayers ShotRenderer::render(int frame, double scale) {
  return render(frame, scale, script_.output->aov);
}

method::FrameLayers ShotRenderer::renderSharp(int frame, double scale, const std::vector<std::string>& aovs) {
  return exposed(frame, picture(frame, camera(frame, scale), aovs));
}

method::FrameLayers ShotRenderer::renderObject(int frame, double scale,
                                               const std::vector<std::string>& aovs) {
  return exposed(frame, picture(frame, camera(frame, scale), aovs, false));
}

int ShotRenderer::samples(int frame) const {
  return scene::blurAt(script_, scene::shotTime(script_, frame)).isSharp() ? 1 : script_.output->samples;
}

double ShotRenderer::focusDistance(const scene::ShotBlur& blur,
                                   const capture::Camera<ObjectSpace>& camera) const {
  if (blur.focusDistance) return *blur.focusDistance;
  const auto middle = assume<Point3<ObjectSpace, double>>(renderer_.describe().middle.raw());
  const double depth = -camera.cameraFromWorld(middle).z();
  if (!(depth > 0))
    throw Error("missing, and the object's middle is not before the camera")
        .at("camera.focus_distance")
        .in(script_.path);
  return depth;
}

capture::Camera<ObjectSpace> ShotRenderer::cameraOf(const scene::ShotBlur& blur, const BlurSample& sample,
                                                    double frame, double scale) const {
  const capture::Camera<ObjectSpace> middle = camera(frame, scale);
  if (blur.aperture == 0) return middle;
  try {
    return throughLensPoint(middle, 0.5 * blur.aperture * sample.lens, focusDistance(blur, middle));
  } catch (Error& error) {
    throw error.file().empty() ? std::move(error).at("camera").in(script_.path) : std::move(error);
  }
}

method::FrameLayers ShotRenderer::render(int frame, double scale, const std::vector<std::string>& aovs) {
  const scene::ShotBlur blur = scene::blurAt(script_, scene::shotTime(script_, frame));
  if (blur.isSharp()) return renderSharp(frame, scale, aovs);
  std::vector<std::string> blurred = aovs;
  const bool showsDepth = std::erase(blurred, kDepth) > 0;
  LayerSums sums;
  const int n = script_.output->samples;
  for (int i = 0; i < n; ++i) {
    const BlurSample sample = blurSample(i, n);
    const double time = frame + blur.shutter * sample.time;
    method::FrameLayers layers = picture(time, cameraOf(blur, sample, time, scale), blurred);
    sums.add(layers);
    memory_ = std::move(layers);
  }
  method::FrameLayers film = sums.mean(std::exchange(memory_, {}));
  if (showsDepth) {
    method::FrameLayers sharp = renderSharp(frame, scale, {kDepth});
    film.aovs[kDepth] = std::move(sharp.aovs[kDepth]);
    addReport(film.report, sharp.report);
  }
  return exposed(frame, std::move(film));
}

ShotRenderer::BlurSteps ShotRenderer::blurSteps(int frame, double scale) const {
  const scene::ShotBlur blur = scene::blurAt(script_, scene::shotTime(script_, frame));
  BlurSteps steps;
  if (blur.isSharp()) return steps;
  constexpr int kInstants = 5;
  constexpr size_t kPoints = 500;
  const auto points = renderer_.describe().points;
  const size_t stride = std::max<size_t>(1, points.size() / kPoints);
  std::vector<std::optional<capture::Pixel>> before;
  std::vector<double> paths;
  for (int k = 0; k < kInstants; ++k) {
    const double time = frame + blur.shutter * (k / (kInstants - 1.0) - 0.5);
    const capture::Camera<ObjectSpace> view = camera(time, scale);
    const double focus = blur.aperture > 0 ? focusDistance(blur, view) : 1;
    const warp::WarpPointer warp = scene::warpAt(script_, scene::shotTime(script_, time));
    std::vector<std::optional<capture::Pixel>> now;
    for (size_t i = 0; i < points.size(); i += stride) {
      const auto place = assume<Point3<ObjectSpace, double>>(warp->position(points[i].raw().cast<double>()));
      now.push_back(view.project(place));
      if (!now.back() || !capture::contains(view.lens, *now.back())) continue;
      if (blur.aperture > 0)
        steps.defocus = std::max(steps.defocus, circleOfConfusion(blur.aperture, view.lens.focalX, focus,
                                                                  -view.cameraFromWorld(place).z()));
    }
    if (k == 0) paths.resize(now.size());
    for (size_t i = 0; k > 0 && i < now.size(); ++i)
      if (before[i] && now[i] &&
          (capture::contains(view.lens, *before[i]) || capture::contains(view.lens, *now[i])))
        paths[i] += std::hypot(now[i]->x - before[i]->x, now[i]->y - before[i]->y);
    before = std::move(now);
  }
  for (const double path : paths) steps.motion = std::max(steps.motion, path);
  // Samples lie on a line, or share the area of a disc.
  const double inLine = steps.motion / kSeenStep, ofDisc = steps.defocus / kSeenStep;
  const double needed = std::max(inLine, std::numbers::pi / 4 * ofDisc * ofDisc);
  steps.needed = static_cast<int>(std::ceil(std::clamp(needed, 1.0, 1e6)));
  return steps;
}

method::FrameLayers ShotRenderer::renderAlbedo(int frame, double scale) {
  if (!white_) {
    image::Image radiance(2, 1, 3);
    std::ranges::fill(radiance.values, 1.f);
    white_ = std::make_shared<const weights::EnvironmentMap>(
        weights::environmentOf(radiance, weights::EnvironmentMapping::latLong, progress_));
  }
  return withScene(frame, camera(frame, scale), [&](scene::Scene scene) {
    scene::ShotEnvironment environment;
    environment.map = white_;
    scene.lights = {environment};
    scene.ground.reset();
    return renderer_.render(scene, {}, progress_);
  });
}

method::PhotographBlend ShotRenderer::blendedAt(int frame, double scale, capture::Pixel pixel) {
  return withScene(frame, camera(frame, scale),
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
      white = std::max(white, whiteOf(renderObject(frame, 0.25, {}).color));
    }
    exposure_ = white > 0 ? 1 / white : 1;
  }
  return *exposure_;
}

} // namespace surflect::film
