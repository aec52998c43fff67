// How smoothly a picture follows a light that goes round the object, and how closely. A JSON report on
// stdout; a picture of it.
//
//   light_sweep MODEL SWEEP OUT.png
//
// SWEEP is a capture of one view whose directional lights, in their order, are the sweep: the truth. The
// report has, for the truth and for each way to blend the model's lights, the RMS and the largest second
// difference of a pixel's radiance along the sweep, and the RMS error; 1 is the white of the model. Pixels
// count that the truth and all ways see covered. The picture has a band for each in this order: the middle
// row of pixels, from left to right, as the light goes from top to bottom.

#include "bench/ablation/sweep.h"
#include "bench/ablation/variants.h"
#include "render/film/frame_file.h"
#include "srf/capture/photograph.h"
#include "srf/image/over_black.h"
#include "surfel/base/error.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

using namespace surflect;

namespace {

using Json = nlohmann::ordered_json;

struct Way {
  std::string name;
  std::vector<image::Image> pictures; // RGBA, premultiplied, a step of the light each
};

Way photographed(const capture::Capture& sweep) {
  std::vector<size_t> frames(sweep.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  Way way{"truth", {}};
  for (const capture::Photograph& photograph : capture::readPhotographs(sweep, frames))
    way.pictures.push_back(image::overBlack(photograph.radiance, photograph.alpha));
  return way;
}

std::vector<scene::ShotLight> lightsOf(const capture::Capture& sweep) {
  std::vector<scene::ShotLight> lights;
  for (const capture::Frame& frame : sweep.frames) {
    if (!frame.light) throw Error::mismatch("a light for each frame", "none").at("frames").in(sweep.file);
    lights.push_back(scene::inObjectSpace(sweep.lights[*frame.light]));
  }
  return lights;
}

std::vector<Way> waysOf(const model::Model& model, const capture::Capture& sweep) {
  if (sweep.views.size() != 1 || sweep.frames.size() < 3)
    throw Error::mismatch("one view under three lights or more",
                          std::to_string(sweep.views.size()) + " views, " +
                              std::to_string(sweep.frames.size()) + " frames")
        .in(sweep.file);
  if (!model.isFullProduct) throw Error("a full product of cameras and lights is needed").in(model.folder);
  const auto lights = lightsOf(sweep);
  codec::BlockCache cache(model.files, size_t{1} << 30);
  const warp::WarpPointer still = warp::chainWarp({});
  const auto view = [&](const model::ShadeOptions& shade) {
    return SplatView{model, *still, scene::inObjectSpace(sweep.views[0].camera), {shade, {}, {}}, cache};
  };
  const auto of = [&](const model::ShadeOptions& shade) {
    return withDirections(view(shade), byPolarFactor);
  };
  const std::pair<const char*, evaluation::Renderer> renderers[] = {
      {"default", of({})},
      {"mean_of_3", of({.lights = 3, .lightFit = ulr::LightFit::mean, .foreshortened = false})},
      {"light_hull", withLightHull(view({}))},
      {"nearest", of({.nearest = true})}};
  std::vector<Way> ways{photographed(sweep)};
  for (const auto& [name, renderer] : renderers) {
    Way& way = ways.emplace_back(Way{name, {}});
    for (const scene::ShotLight& light : lights) way.pictures.push_back(renderer({&light, 1}));
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
  const SecondDifferences second = secondDifferences(way.pictures, mask, white);
  evaluation::PooledMean error;
  for (size_t i = 0; i < way.pictures.size(); ++i)
    error += evaluation::squaredError(way.pictures[i], truth.pictures[i], mask);
  return {{"rms", second.rms}, {"largest", second.largest}, {"error", std::sqrt(error.mean()) / white}};
}

// A band beside the other for each way.
image::Image bandsOf(std::span<const Way> ways) {
  constexpr size_t kZoom = 4, kGap = 4;
  const image::Image& first = ways[0].pictures[0];
  const auto width = static_cast<size_t>(first.width), steps = ways[0].pictures.size();
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

Json measure(const std::filesystem::path& folder, const std::filesystem::path& capture,
             const std::filesystem::path& picture) {
  const model::Model model = model::openModel(folder);
  const auto ways = waysOf(model, capture::readCapture(capture));
  const image::Mask mask = coveredByAll(ways);
  Json report;
  for (const Way& way : ways) report[way.name] = jsonOf(way, ways[0], mask, model.white);
  film::writePreview(picture, bandsOf(ways), 1 / model.white);
  return report;
}

} // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: light_sweep MODEL SWEEP OUT.png\n");
    return 2;
  }
  try {
    std::printf("%s\n", measure(argv[1], argv[2], argv[3]).dump(2).c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "light_sweep: %s\n", error.what());
    return 1;
  }
}
