#include "bench/gallery/figures.h"

#include "render/film/frame_file.h"
#include "srf/capture/capture.h"
#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "srf/image/image_file.h"
#include "srf/image/over_black.h"
#include "srf/image/png.h"
#include "srf/ulr/environment_map.h"
#include "surfel/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace surflect::bench {

namespace {

// Direction in the world with z up; the middle of the environment lies along y.
Vec3<double> inWorld(const Direction3<EnvironmentSpace, double>& d) { return {d.x(), -d.z(), d.y()}; }

size_t nearestLight(const std::vector<Vec3<double>>& towards, const Vec3<double>& direction) {
  size_t nearest = 0;
  for (size_t l = 1; l < towards.size(); ++l)
    if (towards[l].dot(direction) > towards[nearest].dot(direction)) nearest = l;
  return nearest;
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

image::Image weighted(image::Image film, const Rgb& weight) {
  const std::array weights{weight.r, weight.g, weight.b};
  for (size_t i = 0; i < film.values.size(); i += 4)
    for (size_t c = 0; c < 3; ++c) film.values[i + c] *= weights[c];
  return film;
}

Rgb dividedBy(const Rgb& a, const Rgb& b) { return {a.r / b.r, a.g / b.g, a.b / b.b}; }

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
  std::vector<Vec3<double>> towards; // per frame
  std::vector<Rgb> irradiance;
  for (const capture::Frame& frame : capture.frames) {
    const capture::Light& light = capture.lights[*frame.light];
    towards.push_back(capture::towardsLight(light, {0, 0, 0}).raw());
    irradiance.push_back(capture::irradianceAt(light, {0, 0, 0}));
  }

  // Assigns each texel to its nearest light.
  const image::Image radiance = image::readPicture(environmentFile).image;
  const ulr::EnvironmentMap map = ulr::environmentOf(radiance, ulr::EnvironmentMapping::latLong);
  std::vector<Rgb> gatheredIrradiance(towards.size());
  for (const ulr::EnvironmentLight& texel : map.texels) {
    Rgb& sum = gatheredIrradiance[nearestLight(towards, inWorld(texel.towards.cast<double>()))];
    sum = sum + texel.irradiance;
  }
  std::vector<size_t> lightOf; // nearest light of each texel
  std::vector<double> solidAngle(towards.size());
  for (int y = 0; y < radiance.height; ++y)
    for (int x = 0; x < radiance.width; ++x) {
      const double u = (x + 0.5) / radiance.width, v = (y + 0.5) / radiance.height;
      lightOf.push_back(nearestLight(towards, inWorld(ulr::latLongDirection(u, v))));
      solidAngle[lightOf.back()] += std::sin(std::numbers::pi * v) * 2 * std::numbers::pi / radiance.width *
                                    std::numbers::pi / radiance.height;
    }
  image::Image coarse(radiance.width, radiance.height, 3);
  for (size_t i = 0; i < lightOf.size(); ++i) {
    const Rgb mean = static_cast<float>(1 / solidAngle[lightOf[i]]) * gatheredIrradiance[lightOf[i]];
    std::ranges::copy(std::array{mean.r, mean.g, mean.b}, &coarse.values[3 * i]);
  }
  writeForTheEye(folder / "environment.png", radiance);
  writeForTheEye(folder / "lights.png", coarse);

  std::vector<size_t> frames(capture.frames.size());
  std::iota(frames.begin(), frames.end(), 0);
  const std::vector<capture::Photograph> photographs = capture::readPhotographs(capture, frames);
  std::vector<image::Image> films;
  for (const size_t f : frames)
    films.push_back(weighted(filmOf(photographs[f]), dividedBy(gatheredIrradiance[f], irradiance[f])));

  // Lights by descending contribution to the sum.
  std::vector<float> light;
  for (const image::Image& film : films) light.push_back(std::reduce(film.values.begin(), film.values.end()));
  std::vector<size_t> heaviest = frames;
  std::ranges::stable_sort(heaviest, std::greater(), [&](size_t f) { return light[f]; });
  for (size_t k = 0; k < std::min<size_t>(5, heaviest.size()); ++k) {
    film::writeFrame(folder / fmt::format("captured-{}.exr", k), {filmOf(photographs[heaviest[k]]), {}}, {});
    film::writeFrame(folder / fmt::format("weighted-{}.exr", k), {films[heaviest[k]], {}}, {});
  }
  image::Image sum = films[0];
  for (size_t f = 1; f < films.size(); ++f)
    for (size_t i = 0; i < sum.values.size(); i += 4)
      for (size_t c = 0; c < 3; ++c) sum.values[i + c] += films[f].values[i + c];
  film::writeFrame(folder / "sum.exr", {sum, {}}, {});
}

} // namespace surflect::bench
