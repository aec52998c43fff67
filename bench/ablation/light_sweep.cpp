// How smoothly a picture follows a light: a lamp goes round the object a degree at a time, and pixels are
// watched. A JSON report on stdout; a picture of it.
//
//   light_sweep MODEL OUT.png
//
// Per way to blend lights, the RMS and the largest second difference L(i-1) - 2 L(i) + L(i+1) of a pixel's
// radiance along the sweep, white being 1. The picture has a band for each way, in the order of the report:
// the middle row of pixels, from left to right, as the light turns from top to bottom.

#include "bench/ablation/variants.h"
#include "render/film.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>

using namespace surflect;

namespace {

using Json = nlohmann::ordered_json;

constexpr int kSteps = 90; // of a degree
constexpr double kElevation = 20 * std::numbers::pi / 180;

// RGBA, premultiplied, a step of the light each.
std::vector<Image> sweep(const Renderer& renderer) {
  std::vector<Image> pictures;
  for (int step = 0; step < kSteps; ++step) {
    const double azimuth = step * std::numbers::pi / 180;
    const Vec3<double> towards(std::cos(kElevation) * std::cos(azimuth),
                               std::cos(kElevation) * std::sin(azimuth), std::sin(kElevation));
    const std::vector<ShotLight> light{
        ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(towards), {3, 3, 3}}};
    pictures.push_back(renderer(light));
  }
  return pictures;
}

Json roughness(std::span<const Image> pictures, double white) {
  PooledMean squares;
  double largest = 0;
  for (size_t i = 1; i + 1 < pictures.size(); ++i)
    for (size_t v = 0; v < pictures[i].values.size(); ++v) {
      if (v % 4 == 3 || !(pictures[i].values[v | 3] > 0.5f)) continue;
      const double second = (double{pictures[i - 1].values[v]} - 2 * double{pictures[i].values[v]} +
                             pictures[i + 1].values[v]) /
                            white;
      squares += {second * second, 1};
      largest = std::max(largest, std::abs(second));
    }
  return {{"rms", std::sqrt(squares.mean())}, {"largest", largest}};
}

void appendBand(std::span<const Image> pictures, Image& bands) {
  for (const Image& picture : pictures) {
    const auto row =
        picture.values.begin() + static_cast<std::ptrdiff_t>(4 * picture.width * (picture.height / 2));
    bands.values.insert(bands.values.end(), row, row + 4 * picture.width);
    ++bands.height;
  }
  bands.width = pictures[0].width;
  bands.channels = 4;
}

Json measure(const std::filesystem::path& folder, const std::filesystem::path& picture) {
  const Model model = openModel(folder);
  BlockCache cache(model.files, size_t{1} << 30);
  const WarpPointer still = chainWarp({});
  const auto view = [&](const ShadeOptions& shade) {
    return SplatView{model, *still, inObjectSpace(model.rig.views[0].camera), {shade, {}, {}}, cache};
  };
  const auto of = [&](const ShadeOptions& shade) { return withDirections(view(shade), byPolarFactor); };
  const std::pair<const char*, Renderer> ways[] = {
      {"default", of({})},
      {"mean_of_3", of({.lights = 3, .lightFit = LightFit::mean, .foreshortened = false})},
      {"plane_of_4", of({.lights = 4, .lightFit = LightFit::plane, .foreshortened = false})},
      {"light_hull", withLightHull(view({}))},
      {"nearest", of({.nearest = true})}};
  Json report;
  Image bands;
  for (const auto& [name, renderer] : ways) {
    const auto pictures = sweep(renderer);
    report[name] = roughness(pictures, model.white);
    appendBand(pictures, bands);
  }
  writePreview(picture, bands, 1 / model.white);
  return report;
}

} // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: light_sweep MODEL OUT.png\n");
    return 2;
  }
  try {
    std::printf("%s\n", measure(argv[1], argv[2]).dump(2).c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "light_sweep: %s\n", error.what());
    return 1;
  }
}
