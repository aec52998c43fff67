#include "render/evaluation/evaluate.h"

#include "render/evaluation/lambert_view.h"
#include "srf/capture/origin.h"
#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "srf/image/over_black.h"
#include "srf/image/percentile.h"
#include "srf/proxy/mesh/mesh_mending.h"
#include "surfel/base/error.h"
#include "surfel/geometry/ray_caster.h"
#include "warp/deform.h"

#include <algorithm>
#include <optional>
#include <set>

namespace surflect::evaluation {

namespace {

constexpr int kErosion = 2; // pixels

// Reads ground truth as the protocol requires: RGBA, premultiplied. Without a matte, alpha is the silhouette
// of the mesh, or 1 in a capture of one view without a mesh.
class TruthReader {
public:
  // The photographs show the capture's geometry after the warp; the mesh is repaired by the views of the rig,
  // as pack did.
  TruthReader(const capture::Capture& capture, const capture::Capture& rig, const warp::Warp& warp)
      : capture_(capture), rig_(rig), warp_(warp) {}

  std::vector<image::Image> read(std::span<const size_t> frames, const Progress& progress) {
    std::vector<image::Image> truths;
    for (const capture::Photograph& photograph : capture::readPhotographs(capture_, frames, progress)) {
      const image::Image& alpha = photograph.hasMatte || isWholeImage()
                                      ? photograph.alpha
                                      : silhouetteOf(capture_.frames[frames[0]].view);
      truths.push_back(image::overBlack(photograph.radiance, alpha));
    }
    return truths;
  }

private:
  // Returns true if a single view without geometry is a whole image; see meshOfOneView.
  bool isWholeImage() const { return capture_.views.size() == 1 && capture_.geometry.empty(); }

  const image::Image& silhouetteOf(size_t view) {
    if (view_ != view) {
      if (!mesh_) {
        if (capture_.geometry.empty())
          throw Error("neither mattes nor geometry: no object to measure").in(capture_.file);
        mesh_.emplace(
            warp::deform(proxy::readMended(capture_.folder() / capture_.geometry, rig_).mesh, warp_));
      }
      silhouette_ = capture::silhouette(scene::inObjectSpace(capture_.views[view].camera), *mesh_);
      view_ = view;
    }
    return silhouette_;
  }

  const capture::Capture &capture_, &rig_;
  const warp::Warp& warp_;
  std::optional<RayCaster<ObjectSpace>> mesh_;
  std::optional<size_t> view_;
  image::Image silhouette_;
};

std::string groupOf(bool knownCamera, bool knownLight) {
  if (knownCamera) return knownLight ? "known" : "new_light";
  return knownLight ? "new_camera" : "new_both";
}

capture::Capture ofSplit(const capture::Capture& capture, capture::Split split) {
  return capture::subset(capture, [&](const capture::Frame& frame) { return frame.split == split; });
}

std::vector<std::vector<size_t>> framesByView(const capture::Capture& capture) {
  std::vector<std::vector<size_t>> frames(capture.views.size());
  for (size_t i = 0; i < capture.frames.size(); ++i) frames[capture.frames[i].view].push_back(i);
  return frames;
}

// Exposure that maps the 99.5th percentile of the true object pixels to 1.
double exposureOf(const capture::Capture& capture, const capture::Capture& rig, const warp::Warp& warp,
                  const Progress& progress) {
  TruthReader truths(capture, rig, warp);
  image::PercentileCounter values;
  const auto frames = framesByView(capture);
  for (size_t view = 0; view < frames.size(); ++view) {
    progress("exposure", static_cast<double>(view) / static_cast<double>(frames.size()));
    for (const image::Image& truth : truths.read(frames[view], progress))
      for (size_t i = 0; i < truth.values.size(); i += 4)
        if (truth.values[i + 3] > 0.5f)
          std::for_each_n(&truth.values[i], 3, [&](float value) { values.add(value); });
  }
  const double white = values.percentile(0.995);
  return white > 0 ? 1 / white : 1;
}

Score scoreOf(const image::Image& truth, const image::Image& rendered, double exposure) {
  Score score;
  score.difference = compare(truth, rendered, exposure);
  const image::Image exposedTruth = applyExposure(truth, exposure);
  const image::Mask interior = image::eroded(image::objectMask(truth), kErosion);
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

Evaluation evaluate(render::Renderer& renderer, const capture::Capture& asRead, const warp::Warp& warp,
                    const EvaluateOptions& options, const Progress& progress) {
  const capture::Capture& rig = renderer.describe().rig;
  const Point3<AcquisitionSpace, double> middle = renderer.describe().middle;
  const capture::Capture everything = capture::countedFrom(asRead, rig.origin);
  const capture::Capture capture = ofSplit(everything, options.split);
  if (capture.frames.empty())
    throw Error::mismatch(options.split == capture::Split::test ? "test frames" : "training frames", "none")
        .at("frames")
        .in(capture.file);
  const capture::Capture test = ofSplit(everything, capture::Split::test);
  const capture::Capture training = ofSplit(everything, capture::Split::train);
  Evaluation evaluation;
  evaluation.exposure = exposureOf(test.frames.empty() ? capture : test, rig, warp, progress);

  const auto frames = framesByView(capture);
  TruthReader truths(capture, rig, warp);
  std::set<std::string> knownCameras, knownLights;
  for (const auto& view : rig.views) knownCameras.insert(view.identity);
  for (const auto& light : rig.lights) knownLights.insert(light.identity);
  for (size_t view = 0; view < frames.size(); ++view) {
    progress("evaluate", static_cast<double>(view) / static_cast<double>(frames.size()));
    const auto truth = truths.read(frames[view], progress);
    const auto camera = scene::inObjectSpace(capture.views[view].camera);
    std::optional<LambertView> lambert;
    if (options.lambert) lambert.emplace(training, capture.views[view], truth[0], progress);
    for (size_t i = 0; i < truth.size(); ++i) {
      progress.checkpoint();
      const capture::Frame& frame = capture.frames[frames[view][i]];
      FrameScore result;
      std::vector<scene::ShotLight> lights;
      bool knownLight = true;
      if (frame.light) {
        const capture::Light& light = capture.lights[*frame.light];
        lights.push_back(scene::inObjectSpace(light));
        result.light = light.identity;
        result.frontLit = dot(capture::towardsLight(light, middle),
                              capture::Viewpoint(capture.views[view].camera).towards(middle)) >= 0;
        knownLight = knownLights.contains(light.identity);
      }
      result.camera = capture.views[view].identity;
      result.group = groupOf(knownCameras.contains(result.camera), knownLight);
      const scene::Scene scene{warp, camera, std::move(lights)};
      const image::Image ours = renderer.render(scene, {}, progress).color;
      result.maskIou = image::intersectionOverUnion(image::objectMask(truth[i]), image::objectMask(ours));
      result.score = scoreOf(truth[i], ours, evaluation.exposure);
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
