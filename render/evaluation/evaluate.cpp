#include "render/evaluation/evaluate.h"

#include "render/evaluation/lambert_view.h"
#include "render/evaluation/true_frames.h"
#include "srf/capture/origin.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <optional>
#include <set>

namespace surflect::evaluation {

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

} // namespace surflect::evaluation
