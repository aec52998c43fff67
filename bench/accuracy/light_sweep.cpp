// Smoothness and accuracy of renderings under a light that moves around the object.
//
// SWEEP is a capture of one view whose lights, in order, form the sweep: the truth. The report states, for
// the truth and for each way to weight photographs, the RMS and the largest second difference of a pixel's
// radiance along the sweep, and the RMS error relative to the model's white, over pixels that are covered in
// all pictures. OUT.png has a band for each in the same order: the middle row of pixels from left to right,
// with the light moving from top to bottom.
#include "bench/accuracy/program.h"
#include "render/film/display.h"
#include "render/surfels/frame.h"
#include "srf/capture/photograph.h"
#include "srf/image/image.h"
#include "srf/model/model.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace surflect::bench {
namespace {

struct Way {
  std::string name;
  std::vector<image::Image> pictures; // RGBA, premultiplied; one for each light
};

std::vector<Way> waysOf(const model::Model& model, const capture::Capture& sweep) {
  if (sweep.views.size() != 1 || sweep.frames.size() < 3)
    throw Error("needs one view under three lights or more").in(sweep.file);
  std::vector<size_t> frames(sweep.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  std::vector<Way> ways{{"truth", {}}};
  for (const capture::Photograph& photograph : capture::readPhotographs(sweep, frames))
    ways[0].pictures.push_back(image::overBlack(photograph.radiance, photograph.alpha));

  const warp::WarpPointer still = warp::chainWarp({});
  const auto camera = scene::inObjectSpace(sweep.views[0].camera);
  surfels::FrameWorkspace workspace(model, size_t{1} << 30);
  const std::pair<const char*, weights::ShadeOptions> blends[] = {
      {"default", {}},
      {"paper", {.interpolation = weights::Interpolation::paper}},
      {"nearest", {.nearest = true}}};
  for (const auto& [name, shade] : blends) {
    Way& way = ways.emplace_back(Way{name, {}});
    for (const capture::Frame& frame : sweep.frames) {
      if (!frame.light) throw Error::mismatch("a light for each frame", "none").at("frames").in(sweep.file);
      const scene::ShotLight light = scene::inObjectSpace(sweep.lights[*frame.light]);
      surfels::FrameOptions options;
      options.shade = shade;
      way.pictures.push_back(
          surfels::renderFrame(model, {*still, camera, {light}}, options, workspace).color);
    }
  }
  return ways;
}

image::Mask coveredByAll(std::span<const Way> ways) {
  image::Mask mask = image::objectMask(ways[0].pictures[0]);
  for (const Way& way : ways) {
    const image::Mask other = image::objectMask(way.pictures[0]);
    for (size_t i = 0; i < mask.inside.size(); ++i) mask.inside[i] &= other.inside[i];
  }
  return mask;
}

Json jsonOf(const Way& way, const Way& truth, const image::Mask& mask, double white) {
  evaluation::PooledMean squares, error;
  double largest = 0;
  for (size_t i = 0; i < way.pictures.size(); ++i) {
    error += evaluation::squaredError(way.pictures[i], truth.pictures[i], mask);
    if (i == 0 || i + 1 == way.pictures.size()) continue;
    for (size_t pixel = 0; pixel < mask.inside.size(); ++pixel)
      for (size_t c = 0; mask.inside[pixel] && c < 3; ++c) {
        const auto value = [&](size_t step) { return double{way.pictures[step].values[4 * pixel + c]}; };
        const double second = (value(i - 1) - 2 * value(i) + value(i + 1)) / white;
        squares += {second * second, 1};
        largest = std::max(largest, std::abs(second));
      }
  }
  return {
      {"rms", std::sqrt(squares.mean())}, {"largest", largest}, {"error", std::sqrt(error.mean()) / white}};
}

image::Image bandsOf(std::span<const Way> ways) {
  constexpr size_t kZoom = 4, kGap = 4;
  const auto width = static_cast<size_t>(ways[0].pictures[0].width), steps = ways[0].pictures.size();
  const size_t columns = ways.size() * (width + kGap) - kGap;
  image::Image bands(static_cast<int>(kZoom * columns), static_cast<int>(kZoom * steps), 4);
  for (size_t y = 0; y < kZoom * steps; ++y)
    for (size_t x = 0; x < kZoom * columns; ++x) {
      const size_t way = x / kZoom / (width + kGap), column = x / kZoom % (width + kGap);
      if (column >= width) continue;
      const image::Image& picture = ways[way].pictures[y / kZoom];
      std::ranges::copy(picture.at(static_cast<int>(column), picture.height / 2),
                        bands.at(static_cast<int>(x), static_cast<int>(y)).begin());
    }
  return bands;
}

Json lightSweep(const Words& words) {
  const model::Model model = model::openModel(words[0]);
  const auto ways = waysOf(model, capture::readCapture(words[1]));
  const image::Mask mask = coveredByAll(ways);
  Json report;
  for (const Way& way : ways) report[way.name] = jsonOf(way, ways[0], mask, model.white);
  writeFileAtomically(words[2], film::pngBytes(film::shownColor(
                                    bandsOf(ways), {.white = model.white, .isTransparent = true})));
  return report;
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  return surflect::bench::runProgram(argc, argv, "light_sweep MODEL SWEEP OUT.png", {3},
                                     surflect::bench::lightSweep);
}
