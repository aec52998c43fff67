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

namespace surflect {

namespace {

constexpr int kErosion = 2; // pixels

// The truth as the protocol wants it: RGBA, premultiplied. Without a matte the mesh's silhouette stands in,
// or the whole picture of a capture that has one view and no mesh.
class TruthReader {
public:
  // The photographs show the capture's geometry after the warp, mended by the views of the rig as pack
  // did.
  TruthReader(const Capture& capture, const Capture& rig, const Warp& warp)
      : capture_(capture), rig_(rig), warp_(warp) {}

  std::vector<Image> read(std::span<const size_t> frames, const Progress& progress) {
    std::vector<Image> truths;
    for (const Photograph& photograph : readPhotographs(capture_, frames, progress)) {
      const Image& alpha = photograph.hasMatte || isWholeImage()
                               ? photograph.alpha
                               : silhouetteOf(capture_.frames[frames[0]].view);
      truths.push_back(overBlack(photograph.radiance, alpha));
    }
    return truths;
  }

private:
  // With one view and nothing else, see meshOfOneView.
  bool isWholeImage() const { return capture_.views.size() == 1 && capture_.geometry.empty(); }

  const Image& silhouetteOf(size_t view) {
    if (view_ != view) {
      if (!mesh_) {
        if (capture_.geometry.empty())
          throw Error("neither mattes nor geometry: no object to measure").in(capture_.file);
        mesh_.emplace(deform(readMended(capture_.folder() / capture_.geometry, rig_).mesh, warp_));
      }
      silhouette_ = silhouette(inObjectSpace(capture_.views[view].camera), *mesh_);
      view_ = view;
    }
    return silhouette_;
  }

  const Capture &capture_, &rig_;
  const Warp& warp_;
  std::optional<RayCaster<ObjectSpace>> mesh_;
  std::optional<size_t> view_;
  Image silhouette_;
};

std::string groupOf(bool knownCamera, bool knownLight) {
  if (knownCamera) return knownLight ? "known" : "new_light";
  return knownLight ? "new_camera" : "new_both";
}

Capture ofSplit(const Capture& capture, Split split) {
  return subset(capture, [&](const Frame& frame) { return frame.split == split; });
}

std::vector<std::vector<size_t>> framesByView(const Capture& capture) {
  std::vector<std::vector<size_t>> frames(capture.views.size());
  for (size_t i = 0; i < capture.frames.size(); ++i) frames[capture.frames[i].view].push_back(i);
  return frames;
}

// Maps the 99.5th percentile of the true object pixels to 1.
double exposureOf(const Capture& capture, const Capture& rig, const Warp& warp, const Progress& progress) {
  TruthReader truths(capture, rig, warp);
  PercentileCounter values;
  const auto frames = framesByView(capture);
  for (size_t view = 0; view < frames.size(); ++view) {
    progress("exposure", static_cast<double>(view) / static_cast<double>(frames.size()));
    for (const Image& truth : truths.read(frames[view], progress))
      for (size_t i = 0; i < truth.values.size(); i += 4)
        if (truth.values[i + 3] > 0.5f)
          std::for_each_n(&truth.values[i], 3, [&](float value) { values.add(value); });
  }
  const double white = values.percentile(0.995);
  return white > 0 ? 1 / white : 1;
}

Score scoreOf(const Image& truth, const Image& rendered, double exposure) {
  Score score;
  score.difference = compare(truth, rendered, exposure);
  const Image exposedTruth = exposed(truth, exposure);
  const Mask interior = eroded(objectMask(truth), kErosion);
  score.interiorError = squaredError(exposedTruth, exposed(rendered, exposure), interior);
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

Evaluation evaluate(const Model& model, const Capture& asRead, const Warp& warp,
                    const EvaluateOptions& options, BlockCache& cache, const Progress& progress) {
  const Capture everything = countedFrom(asRead, model.rig.origin);
  const Capture capture = ofSplit(everything, options.split);
  if (capture.frames.empty())
    throw Error::mismatch(options.split == Split::test ? "test frames" : "training frames", "none")
        .at("frames")
        .in(capture.file);
  const Capture test = ofSplit(everything, Split::test);
  const Capture training = ofSplit(everything, Split::train);
  Evaluation evaluation;
  evaluation.exposure = exposureOf(test.frames.empty() ? capture : test, model.rig, warp, progress);

  const auto frames = framesByView(capture);
  TruthReader truths(capture, model.rig, warp);
  std::set<std::string> knownCameras, knownLights;
  for (const auto& view : model.rig.views) knownCameras.insert(view.identity);
  for (const auto& light : model.rig.lights) knownLights.insert(light.identity);
  const DeformedCloud deformed = deform(model.cloud, warp, progress, options.frame.splats.simd);
  ShadingStats stats;
  for (size_t view = 0; view < frames.size(); ++view) {
    progress("evaluate", static_cast<double>(view) / static_cast<double>(frames.size()));
    const auto truth = truths.read(frames[view], progress);
    const auto camera = inObjectSpace(capture.views[view].camera);
    const SplatRaster coverage = look(camera, model.cloud, deformed, options.frame.splats, progress);
    std::vector<Renderer> others;
    for (const auto& renderer : options.others) others.push_back(renderer(camera));
    std::optional<LambertView> lambert;
    if (options.baselines.contains(Baseline::lambert))
      lambert.emplace(training, capture.views[view], truth[0], progress);
    for (size_t i = 0; i < truth.size(); ++i) {
      progress.checkpoint();
      const Frame& frame = capture.frames[frames[view][i]];
      FrameScore result;
      std::vector<ShotLight> lights;
      bool knownLight = true;
      if (frame.light) {
        const Light& light = capture.lights[*frame.light];
        lights.push_back(inObjectSpace(light));
        result.light = light.identity;
        result.frontLit = dot(towardsLight(light, model.middle),
                              Viewpoint(capture.views[view].camera).towards(model.middle)) >= 0;
        knownLight = knownLights.contains(light.identity);
      }
      result.camera = capture.views[view].identity;
      result.group = groupOf(knownCameras.contains(result.camera), knownLight);
      const QueryBatch batch = queriesAt(model.cloud, deformed, coverage.visible, camera, lights, progress,
                                         options.frame.splats.simd);
      const auto rendered = [&](const ShadeOptions& shadeOptions) {
        return developRadiance(coverage, shade(model, batch, shadeOptions, cache, stats, progress));
      };
      const auto baseline = [&](Baseline kind) {
        if (kind == Baseline::lambert) return lambert->under(capture.lights[*frame.light]);
        ShadeOptions nearest = options.frame.shade;
        nearest.nearest = true;
        return rendered(nearest);
      };
      const Image ours = rendered(options.frame.shade);
      result.maskIou = intersectionOverUnion(objectMask(truth[i]), objectMask(ours));
      result.score = scoreOf(truth[i], ours, evaluation.exposure);
      for (const Baseline kind : options.baselines)
        result.baselines[kind] = scoreOf(truth[i], baseline(kind), evaluation.exposure);
      for (const Renderer& other : others)
        result.others.push_back(scoreOf(truth[i], other(lights), evaluation.exposure));
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

} // namespace surflect
