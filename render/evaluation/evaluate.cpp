#include "render/evaluation/evaluate.h"

#include "render/evaluation/measure.h"
#include "render/evaluation/true_frames.h"
#include "srf/capture/origin.h"
#include "srf/capture/photograph.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"
#include "surfel/math/median.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace surflect::evaluation {

namespace {

bool isSame(const capture::View& a, const capture::View& b) {
  const auto &p = a.camera.cameraFromWorld, &q = b.camera.cameraFromWorld;
  return a.identity == b.identity && a.camera.lens == b.camera.lens && p.rotation() == q.rotation() &&
         p.translation() == q.translation();
}

} // namespace

LambertView::LambertView(const capture::Capture& training, const capture::View& view,
                         const image::Image& object, const Progress& progress)
    : camera_(view.camera) {
  std::vector<size_t> frames;
  std::vector<capture::Light> lights;
  for (size_t i = 0; i < training.frames.size(); ++i)
    if (const capture::Frame& frame = training.frames[i];
        frame.light && isSame(training.views[frame.view], view)) {
      frames.push_back(i);
      lights.push_back(training.lights[*frame.light]);
    }
  capture::ViewPhotographs photographs = capture::readViewPhotographs(training, frames, progress);
  alpha_ = photographs.hasMatte ? std::move(photographs.alpha) : image::Image(object.width, object.height, 1);
  if (!photographs.hasMatte)
    for (size_t i = 0; i < alpha_.values.size(); ++i)
      alpha_.values[i] = object.values[(i + 1) * static_cast<size_t>(object.channels) - 1];
  image::Mask shown(alpha_.width, alpha_.height);
  std::ranges::transform(alpha_.values, shown.inside.begin(), [](float alpha) { return alpha > 0; });
  try {
    fits_ = relief::fitLambert(camera_, lights, photographs.radiance, shown, progress);
  } catch (Error& error) {
    throw std::move(error).at("the Lambert baseline of " + view.identity).in(training.file);
  }
}

image::Image LambertView::under(const capture::Light& light) const {
  return image::overBlack(relief::relit(fits_, camera_, light), alpha_);
}

namespace {

double square(double x) { return x * x; }

// Mean square of three channels.
double meanSquare(std::span<const float> a) { return (square(a[0]) + square(a[1]) + square(a[2])) / 3; }
double meanSquare(std::span<const float> a, std::span<const float> b) {
  return (square(double{a[0]} - b[0]) + square(double{a[1]} - b[1]) + square(double{a[2]} - b[2])) / 3;
}

} // namespace

TileErrors relativeErrors(const TileErrors& tiles) {
  TileErrors relative;
  for (size_t tile = 0; tile < tiles.measured.size(); ++tile) {
    const double brightness = tiles.brightness[tile];
    if (!(brightness > 0)) continue;
    relative.measured.push_back(tiles.measured[tile] / brightness);
    relative.predicted.push_back(tiles.predicted[tile] / brightness);
    relative.brightness.push_back(1);
  }
  return relative;
}

TileErrors tileErrors(const image::Image& truth, const image::Image& rendered, const image::Image& predicted,
                      double exposure) {
  assert(predicted.channels == 1 && predicted.width == truth.width && predicted.height == truth.height);
  const image::Mask object =
      validPart(image::unionOf(image::objectMask(truth), image::objectMask(rendered)), truth);
  const image::Image a = applyExposure(truth, exposure), b = applyExposure(rendered, exposure);
  TileErrors tiles;
  for (int top = 0; top < truth.height; top += kTileSize)
    for (int left = 0; left < truth.width; left += kTileSize) {
      double measured = 0, expected = 0, brightness = 0, count = 0;
      for (int y = top; y < std::min(top + kTileSize, truth.height); ++y)
        for (int x = left; x < std::min(left + kTileSize, truth.width); ++x) {
          const auto pixel =
              static_cast<size_t>(y) * static_cast<size_t>(truth.width) + static_cast<size_t>(x);
          if (!object.inside[pixel]) continue;
          measured += meanSquare(a.at(x, y), b.at(x, y));
          brightness += meanSquare(b.at(x, y));
          expected += square(exposure * predicted.values[pixel]);
          ++count;
        }
      if (count < kTileCover * kTileSize * kTileSize) continue;
      tiles.measured.push_back(std::sqrt(measured / count));
      tiles.predicted.push_back(std::sqrt(expected / count));
      tiles.brightness.push_back(std::sqrt(brightness / count));
    }
  return tiles;
}

namespace {

constexpr int kErosion = 2; // pixels

std::string groupOf(bool knownCamera, bool knownLight) {
  if (knownCamera) return knownLight ? "known" : "new_light";
  return knownLight ? "new_camera" : "new_both";
}

Score scoreOf(const image::Image& truth, const image::Image& rendered, double exposure) {
  Score score;
  score.difference = compare(truth, rendered, exposure);
  const image::Image exposedTruth = applyExposure(truth, exposure);
  const image::Mask interior = validPart(image::eroded(image::objectMask(truth), kErosion), truth);
  score.interiorError = squaredError(exposedTruth, applyExposure(rendered, exposure), interior);
  score.truthNoise = noiseVariance(exposedTruth, interior);
  score.frames = 1;
  return score;
}

} // namespace

Score& Score::operator+=(const Score& other) {
  difference += other.difference;
  interiorError += other.interiorError;
  truthNoise += other.truthNoise;
  frames += other.frames;
  return *this;
}

Evaluation evaluate(method::Renderer& renderer, const capture::Capture& asRead, const warp::Warp& warp,
                    const EvaluateOptions& options, const Progress& progress) {
  const capture::Capture& rig = renderer.describe().rig;
  const Point3<AcquisitionSpace, double> middle = renderer.describe().middle;
  TrueFrames truths(asRead, rig, warp, options.split, progress);
  const capture::Capture& capture = truths.capture();
  const capture::Capture training =
      options.lambert ? ofSplit(capture::countedFrom(asRead, rig.origin), capture::Split::train)
                      : capture::Capture();
  Evaluation evaluation;
  evaluation.exposure = truths.exposure();

  const auto frames = framesByView(capture);
  std::set<std::string> knownCameras, knownLights;
  for (const auto& view : rig.views) knownCameras.insert(view.identity);
  for (const auto& light : rig.lights) knownLights.insert(light.identity);
  for (size_t view = 0; view < frames.size(); ++view) {
    progress("evaluate", static_cast<double>(view) / static_cast<double>(frames.size()));
    const auto truth = truths.read(frames[view], progress);
    std::optional<LambertView> lambert;
    if (options.lambert) lambert.emplace(training, capture.views[view], truth[0], progress);
    for (size_t i = 0; i < truth.size(); ++i) {
      progress.checkpoint();
      const capture::Frame& frame = capture.frames[frames[view][i]];
      FrameScore result;
      bool knownLight = options.lights.empty();
      if (frame.light) {
        const capture::Light& light = capture.lights[*frame.light];
        result.light = light.identity;
        result.frontLit = dot(capture::towardsLight(light, middle),
                              capture::Viewpoint(capture.views[view].camera).towards(middle)) >= 0;
        knownLight = knownLights.contains(light.identity);
      }
      result.camera = capture.views[view].identity;
      result.group = groupOf(knownCameras.contains(result.camera), knownLight);
      scene::Scene scene = truths.sceneOf(frames[view][i]);
      if (!frame.light) scene.lights = options.lights;
      const std::vector<std::string> aovs(options.confidence ? 1 : 0, "predicted_error");
      const method::FrameLayers layers = renderer.render(scene, aovs, progress);
      const image::Image& ours = layers.color;
      result.maskIou = image::intersectionOverUnion(image::objectMask(truth[i]), image::objectMask(ours));
      result.invalidTexels = invalidTexels(truth[i]);
      result.score = scoreOf(truth[i], ours, evaluation.exposure);
      if (options.confidence) {
        const auto predicted = layers.aovs.find("predicted_error");
        if (predicted == layers.aovs.end())
          throw Error::mismatch("a renderer that predicts its errors", "one that does not")
              .at("predicted_error")
              .in(renderer.describe().folder);
        result.tiles = tileErrors(truth[i], ours, predicted->second, evaluation.exposure);
      }
      for (const auto& [name, other] : options.others)
        result.others[name] =
            scoreOf(truth[i], other->render(scene, {}, progress).color, evaluation.exposure);
      if (lambert)
        result.others["lambert"] =
            scoreOf(truth[i], lambert->under(capture.lights[*frame.light]), evaluation.exposure);
      evaluation.frames.push_back(std::move(result));
    }
  }
  if (std::ranges::none_of(evaluation.frames, [](const FrameScore& frame) {
        return frame.score.difference.squaredErrorLinear.count > 0;
      }))
    throw Error("no pixel of an object, neither in the photographs nor rendered: nothing to measure")
        .at("frames")
        .in(capture.file);
  progress("evaluate", 1);
  return evaluation;
}

namespace {

constexpr double kMovedCamera = 1e-3, kTurnedLight = 1e-2; // of the distance to the object; radians
constexpr double kOtherStrength = 1.1;                     // ratio
constexpr double kLeastOverlap = 0.8;                      // of silhouettes; fur in a coarse model has more

// "3 of 8 cameras stand elsewhere than the model's of the same name: C01, C02, .."
std::optional<std::string> listed(const std::vector<std::string>& names, size_t known, const char* nouns,
                                  const char* fault) {
  if (names.empty()) return std::nullopt;
  return fmt::format("{} of {} {} {} the model's of the same name: {}", names.size(), known, nouns, fault,
                     firstNames(names));
}

double brightest(const Rgb& color) { return std::max({color.r, color.g, color.b}); }

} // namespace

std::vector<std::string> rigMismatches(const method::Description& model, const capture::Capture& asRead) {
  const capture::Capture& rig = model.rig;
  const capture::Capture capture = capture::countedFrom(asRead, rig.origin);
  const Point3<AcquisitionSpace, double> middle = model.middle;
  std::vector<std::string> lines;
  const auto add = [&](std::optional<std::string> line) {
    if (line) lines.push_back(std::move(*line));
  };

  std::vector<bool> isTraining(capture.views.size(), false);
  for (const capture::Frame& frame : capture.frames)
    if (frame.split == capture::Split::train) isTraining[frame.view] = true;
  std::multimap<std::string, const capture::View*> viewsOf; // a camera that moves has several
  for (const capture::View& view : rig.views) viewsOf.emplace(view.identity, &view);
  std::vector<std::string> moved;
  size_t shared = 0, training = 0;
  for (size_t v = 0; v < capture.views.size(); ++v) {
    if (!isTraining[v]) continue;
    ++training;
    const auto [begin, end] = viewsOf.equal_range(capture.views[v].identity);
    if (begin == end) continue;
    ++shared;
    const capture::Viewpoint here(capture.views[v].camera);
    const auto isHere = [&](const auto& known) {
      const capture::Viewpoint there(known.second->camera);
      const double ratio = here.distance(middle) / there.distance(middle); // NaN if both are distant
      return (here.towards(middle).raw() - there.towards(middle).raw()).norm() <= kMovedCamera &&
             !(std::abs(ratio - 1) > kMovedCamera);
    };
    if (std::none_of(begin, end, isHere)) moved.push_back(capture.views[v].identity);
  }
  if (training > 0 && shared == 0 && !rig.views.empty())
    lines.push_back(
        fmt::format("none of the {} training cameras is among the {} that the model was made from", training,
                    rig.views.size()));
  add(listed(moved, shared, "cameras", "stand elsewhere than"));

  std::map<std::string, const capture::Light*> lightOf;
  for (const capture::Light& light : rig.lights) lightOf.emplace(light.name, &light);
  std::vector<std::string> turned, stronger;
  size_t sharedLights = 0;
  for (const capture::Light& light : capture.lights) {
    const auto known = lightOf.find(light.name);
    if (known == lightOf.end()) continue;
    ++sharedLights;
    const double cosine =
        dot(capture::towardsLight(light, middle), capture::towardsLight(*known->second, middle));
    if (!(cosine >= std::cos(kTurnedLight))) turned.push_back(light.name);
    const double ratio = brightest(capture::irradianceAt(light, middle)) /
                         brightest(capture::irradianceAt(*known->second, middle));
    if (!(ratio <= kOtherStrength && ratio >= 1 / kOtherStrength))
      stronger.push_back(fmt::format("{} ({:.3g} times)", light.name, ratio));
  }
  add(listed(turned, sharedLights, "lights", "shine from another direction than"));
  add(listed(stronger, sharedLights, "lights", "differ in strength from"));
  return lines;
}

std::optional<std::string> silhouetteMismatch(const Evaluation& evaluation) {
  std::vector<double> overlaps;
  for (const FrameScore& frame : evaluation.frames) overlaps.push_back(frame.maskIou);
  if (overlaps.empty()) return std::nullopt;
  const double overlap = median(overlaps);
  if (overlap >= kLeastOverlap) return std::nullopt;
  return fmt::format(
      "silhouettes overlap those of the photographs by {:.0f} % only (median of {} frames): do "
      "model and photographs show one object, in one scale and pose?",
      100 * overlap, overlaps.size());
}

} // namespace surflect::evaluation
