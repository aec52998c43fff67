// Terms of the predicted error (render/surfels/predicted_error.h) beside the true error, tile by tile, in
// test frames of a capture: what scripts/confidence fits.
#include "bench/accuracy/program.h"
#include "render/evaluation/evaluate.h"
#include "render/evaluation/true_frames.h"
#include "render/surfels/frame.h"
#include "srf/model/model.h"
#include "warp/warp.h"

namespace surflect::bench {
namespace {

constexpr size_t kCacheBytes = size_t{1} << 28;

Json errorTerms(const Words& words) {
  const model::Model model = model::openModel(words[0]);
  const warp::WarpPointer rest = warp::chainWarp({});
  evaluation::TrueFrames truths(capture::readCapture(words[1]), model.rig, *rest, capture::Split::test, {});
  surfels::FrameWorkspace workspace(model, kCacheBytes);
  surfels::FrameOptions options;
  options.aovs = {"predicted_error"};
  Json rows = Json::array();
  for (const std::vector<size_t>& frames : evaluation::framesByView(truths.capture())) {
    const std::vector<image::Image> pictures = truths.read(frames, {});
    for (size_t i = 0; i < frames.size(); ++i) {
      const auto rendered = [&](const surfels::ErrorModel& errorModel) {
        options.errorModel = errorModel;
        return surfels::renderFrame(model, truths.sceneOf(frames[i]), options, workspace);
      };
      const method::FrameLayers first = rendered({1, 0, 0}), second = rendered({0, 0, 1});
      const image::Image& color = first.color;
      const auto tilesOf = [&](const image::Image& predicted) {
        return evaluation::tileErrors(pictures[i], color, predicted, truths.exposure());
      };
      const image::Image structure =
          surfels::predictedError(color, color, image::Image(color.width, color.height, 1), {0, 1, 0});
      const evaluation::TileErrors ofDisagreement = tilesOf(first.aovs.at("predicted_error")),
                                   ofStructure = tilesOf(structure),
                                   ofGap = tilesOf(second.aovs.at("predicted_error"));
      for (size_t tile = 0; tile < ofGap.measured.size(); ++tile)
        rows.push_back({ofGap.measured[tile], ofDisagreement.predicted[tile], ofStructure.predicted[tile],
                        ofGap.predicted[tile]});
    }
  }
  return {{"columns", {"measured", "disagreement", "structure", "gap"}}, {"tiles", rows}};
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  return surflect::bench::runProgram(argc, argv, "error_terms MODEL CAPTURE", {2},
                                     surflect::bench::errorTerms);
}
