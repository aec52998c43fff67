#include "bench/gallery/figures.h"

#include "render/film/frame_file.h"
#include "render/lightfield/common/relight.h"
#include "srf/capture/capture.h"
#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "srf/image/image.h"
#include "srf/image/image_file.h"
#include "srf/image/png.h"
#include "srf/weights/environment_map.h"
#include "surfel/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <span>

namespace surflect::bench {

namespace {

// World with z up; the middle of the environment lies along y.
Rotation<AcquisitionSpace, EnvironmentSpace> worldFromEnvironment() {
  Mat3<double> rotation;
  rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return Rotation<AcquisitionSpace, EnvironmentSpace>(rotation);
}

// Writes radiance as a PNG with the 97th percentile as white.
void writeForTheEye(const std::filesystem::path& path, image::Image image) {
  std::vector<float> sorted = image.values;
  std::ranges::sort(sorted);
  const float white = sorted[sorted.size() * 97 / 100];
  for (float& value : image.values) value = image::srgbFromLinear(std::clamp(value / white, 0.f, 1.f));
  image::writePng(path, image);
}

image::Image filmOf(const capture::Photograph& photograph) {
  return image::overBlack(photograph.radiance, photograph.alpha);
}

} // namespace

void relightReflectanceImage(const std::filesystem::path& captureFolder, const std::string& camera,
                             const std::filesystem::path& environmentFile,
                             const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const capture::Capture all = capture::readCapture(captureFolder);
  const capture::Capture capture = capture::subset(all, [&](const capture::Frame& frame) {
    return frame.split == capture::Split::train && frame.light && all.views[frame.view].identity == camera;
  });
  if (capture.frames.empty())
    throw Error("has no photographs for training under lights").at(camera).in(captureFolder);
  std::vector<capture::Light> lights; // per frame
  std::vector<Direction3<AcquisitionSpace, double>> towards;
  for (const capture::Frame& frame : capture.frames) {
    lights.push_back(capture.lights[*frame.light]);
    towards.push_back(capture::towardsLight(lights.back(), {0, 0, 0}));
  }

  // Assigns each texel to its nearest light.
  const image::Image radiance = image::readPicture(environmentFile).image;
  const auto map = std::make_shared<const weights::EnvironmentMap>(
      weights::environmentOf(radiance, weights::EnvironmentMapping::latLong));
  const std::array<scene::ShotLight, 1> shot = {
      scene::ShotEnvironment{map, Rotation<ObjectSpace, EnvironmentSpace>(worldFromEnvironment().matrix())}};
  const std::vector<Rgb> weights = lightfield::photographWeights(lights, {0, 0, 0}, shot);
  std::vector<size_t> lightOf; // nearest light of each texel
  std::vector<double> solidAngle(towards.size());
  for (int y = 0; y < radiance.height; ++y)
    for (int x = 0; x < radiance.width; ++x) {
      const double u = (x + 0.5) / radiance.width, v = (y + 0.5) / radiance.height;
      lightOf.push_back(
          lightfield::nearestLight(towards, worldFromEnvironment()(weights::latLongDirection(u, v))));
      solidAngle[lightOf.back()] += std::sin(std::numbers::pi * v) * 2 * std::numbers::pi / radiance.width *
                                    std::numbers::pi / radiance.height;
    }
  image::Image coarse(radiance.width, radiance.height, 3);
  for (size_t i = 0; i < lightOf.size(); ++i) {
    const size_t l = lightOf[i];
    const Rgb gatheredIrradiance = weights[l] * capture::irradianceAt(lights[l], {0, 0, 0});
    const Rgb mean = static_cast<float>(1 / solidAngle[l]) * gatheredIrradiance;
    std::ranges::copy(std::array{mean.r, mean.g, mean.b}, &coarse.values[3 * i]);
  }
  writeForTheEye(folder / "environment.png", radiance);
  writeForTheEye(folder / "lights.png", coarse);

  std::vector<size_t> frames(capture.frames.size());
  std::iota(frames.begin(), frames.end(), 0);
  const std::vector<capture::Photograph> photographs = capture::readPhotographs(capture, frames);
  std::vector<image::Image> films;
  for (const size_t f : frames)
    films.push_back(
        filmOf(lightfield::weightedSum(std::span(&photographs[f], 1), std::span(&weights[f], 1))));

  // Lights by descending contribution to the sum.
  std::vector<float> light;
  for (const image::Image& film : films) light.push_back(std::reduce(film.values.begin(), film.values.end()));
  std::vector<size_t> heaviest = frames;
  std::ranges::stable_sort(heaviest, std::greater(), [&](size_t f) { return light[f]; });
  for (size_t k = 0; k < std::min<size_t>(5, heaviest.size()); ++k) {
    film::writeFrame(folder / fmt::format("captured-{}.exr", k), {filmOf(photographs[heaviest[k]]), {}}, {});
    film::writeFrame(folder / fmt::format("weighted-{}.exr", k), {films[heaviest[k]], {}}, {});
  }
  film::writeFrame(folder / "sum.exr", {filmOf(lightfield::weightedSum(photographs, weights)), {}}, {});
}

} // namespace surflect::bench
