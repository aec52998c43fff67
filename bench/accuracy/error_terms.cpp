// Terms of the predicted error (render/surfels/predicted_error.h) beside the true error, tile by tile, in
// test frames of a capture: what scripts/confidence fits.
#include "bench/accuracy/program.h"
#include "render/evaluation/tile_errors.h"
#include "render/evaluation/true_frames.h"
#include "render/surfels/frame.h"
#include "srf/model/model.h"
#include "warp/warp.h"

#include <cmath>
#include <cstdlib>

namespace surflect::bench {
namespace {

constexpr size_t kCacheBytes = size_t{1} << 28;

// Root mean square of the three channels of each pixel: the simplest prediction, brighter is worse.
image::Image brightnessOf(const image::Image& color) {
  image::Image brightness(color.width, color.height, 1);
  for (size_t pixel = 0; pixel < brightness.values.size(); ++pixel) {
    float sum = 0;
    for (size_t c = 0; c < 3; ++c) sum += color.values[4 * pixel + c] * color.values[4 * pixel + c];
    brightness.values[pixel] = std::sqrt(sum / 3);
  }
  return brightness;
}

Json errorTerms(const Words& words) {
  const model::Model model = model::openModel(words[0]);
  const size_t every = words.size() > 2 ? static_cast<size_t>(std::max(1, std::atoi(words[2].c_str()))) : 1;
  const warp::WarpPointer rest = warp::chainWarp({});
  evaluation::TrueFrames truths(capture::readCapture(words[1]), model.rig, *rest, capture::Split::test, {});
  surfels::FrameWorkspace workspace(model, kCacheBytes);
  surfels::FrameOptions options;
  options.aovs = {"confidence"};
  Json rows = Json::array();
  size_t number = 0;
  for (const std::vector<size_t>& ofView : evaluation::framesByView(truths.capture())) {
    std::vector<size_t> frames;
    for (const size_t frame : ofView)
      if (number++ % every == 0) frames.push_back(frame);
    const std::vector<image::Image> pictures = truths.read(frames, {});
    for (size_t i = 0; i < frames.size(); ++i) {
      const auto tilesWith = [&](const surfels::ErrorModel& errorModel) {
        options.errorModel = errorModel;
        const render::FrameLayers layers =
            surfels::renderFrame(model, truths.sceneOf(frames[i]), options, workspace);
        return std::pair(
            evaluation::tileErrors(pictures[i], layers.color, layers.aovs.at("confidence"),
                                   truths.exposure()),
            evaluation::tileErrors(pictures[i], layers.color, brightnessOf(layers.color), truths.exposure()));
      };
      const auto [disagreement, brightness] = tilesWith({1, 0, 0});
      const evaluation::TileErrors structure = tilesWith({0, 1, 0}).first, gap = tilesWith({0, 0, 1}).first;
      for (size_t tile = 0; tile < gap.measured.size(); ++tile)
        rows.push_back({gap.measured[tile], disagreement.predicted[tile], structure.predicted[tile],
                        gap.predicted[tile], brightness.predicted[tile]});
    }
  }
  return {{"columns", {"measured", "disagreement", "structure", "gap", "brightness"}}, {"tiles", rows}};
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  return surflect::bench::runProgram(argc, argv, "error_terms MODEL CAPTURE [EVERY]", {2, 3},
                                     surflect::bench::errorTerms);
}
