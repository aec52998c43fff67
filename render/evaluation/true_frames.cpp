#include "render/evaluation/true_frames.h"

#include "render/evaluation/measure.h"
#include "srf/capture/origin.h"
#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "srf/image/image.h"
#include "srf/proxy/mesh/mesh_mending.h"
#include "surfel/base/error.h"
#include "surfel/geometry/ray_caster.h"
#include "warp/deform.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace surflect::evaluation {

capture::Capture ofSplit(const capture::Capture& capture, capture::Split split) {
  return capture::subset(capture, [&](const capture::Frame& frame) { return frame.split == split; });
}

std::vector<std::vector<size_t>> framesByView(const capture::Capture& capture) {
  std::vector<std::vector<size_t>> frames(capture.views.size());
  for (size_t i = 0; i < capture.frames.size(); ++i) frames[capture.frames[i].view].push_back(i);
  return frames;
}

capture::Capture withKnownObject(const capture::Capture& capture) {
  const auto hasMask = [](const capture::Frame& frame) { return !frame.mask.empty(); };
  if (!capture.geometry.empty() || std::ranges::none_of(capture.frames, hasMask)) return capture;
  return capture::subset(capture, hasMask);
}

class TrueFrames::TruthReader {
public:
  TruthReader(const capture::Capture& capture, const capture::Capture& rig, const warp::Warp& warp)
      : capture_(capture), rig_(rig), warp_(warp) {}

  std::vector<image::Image> read(std::span<const size_t> frames, const Progress& progress) {
    std::vector<image::Image> truths;
    for (const capture::Photograph& photograph : capture::readPhotographs(capture_, frames, progress)) {
      const image::Image& alpha = photograph.hasMatte || isWholeImage()
                                      ? photograph.alpha
                                      : silhouetteOf(capture_.frames[frames[0]].view);
      image::Image& truth = truths.emplace_back(image::overBlack(photograph.radiance, alpha));
      for (const size_t texel : photograph.invalidTexels)
        std::fill_n(&truth.values[4 * texel], 3, std::numeric_limits<float>::quiet_NaN());
    }
    return truths;
  }

  double exposure(const Progress& progress) {
    image::PercentileCounter values;
    const auto frames = framesByView(capture_);
    for (size_t view = 0; view < frames.size(); ++view) {
      progress("exposure", static_cast<double>(view) / static_cast<double>(frames.size()));
      for (const image::Image& truth : read(frames[view], progress))
        for (size_t i = 0; i < truth.values.size(); i += 4)
          if (truth.values[i + 3] > 0.5f && isValid(truth, i / 4))
            std::for_each_n(&truth.values[i], 3, [&](float value) { values.add(value); });
    }
    const double white = values.percentile(0.995);
    return white > 0 ? 1 / white : 1;
  }

private:
  // Returns true if a single view without geometry is a whole image; see impostorOfOneView.
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

TrueFrames::TrueFrames(const capture::Capture& asRead, const capture::Capture& rig, const warp::Warp& warp,
                       capture::Split split, const Progress& progress)
    : warp_(warp) {
  const capture::Capture everything = withKnownObject(capture::countedFrom(asRead, rig.origin));
  capture_ = ofSplit(everything, split);
  if (capture_.frames.empty())
    throw Error::mismatch(split == capture::Split::test ? "test frames" : "training frames", "none")
        .at("frames")
        .in(capture_.file);
  truths_ = std::make_unique<TruthReader>(capture_, rig, warp);
  const capture::Capture test = ofSplit(everything, capture::Split::test);
  exposure_ = TruthReader(test.frames.empty() ? capture_ : test, rig, warp).exposure(progress);
}

TrueFrames::~TrueFrames() = default;

std::vector<image::Image> TrueFrames::read(std::span<const size_t> frames, const Progress& progress) {
  return truths_->read(frames, progress);
}

scene::Scene TrueFrames::sceneOf(size_t frame) const {
  const capture::Frame& photograph = capture_.frames[frame];
  std::vector<scene::ShotLight> lights;
  if (photograph.light) lights.push_back(scene::inObjectSpace(capture_.lights[*photograph.light]));
  return {warp_, scene::inObjectSpace(capture_.views[photograph.view].camera), std::move(lights)};
}

} // namespace surflect::evaluation
