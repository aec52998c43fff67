#include "render/stage/exposure.h"

#include "render/stage/stage_plan.h"
#include "srf/image/color.h"
#include "surfel/base/file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <locale>
#include <numbers>
#include <sstream>

namespace surflect::stage {

namespace {

// [Box 1958] A note on the generation of random normal deviates.
double normal(Random& random) {
  const double u = 1 - random.next(), v = random.next();
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

} // namespace

uint8_t codeOf(const image::Response& response, float x) {
  const auto& curve = response.exposure[0];
  const auto above = std::ranges::lower_bound(curve, x); // first element not below x
  if (above == curve.begin() || std::isnan(x)) return 0;
  if (above == curve.end()) return static_cast<uint8_t>(image::Response::codes - 1);
  const auto below = above - 1;
  return static_cast<uint8_t>((x - *below <= *above - x ? below : above) - curve.begin());
}

double sensed(double x, const StageExposure& camera, Random& random) {
  if (!(camera.fullWell > 0)) return x;
  const double full = camera.response.exposure[0].back();
  const double electrons = camera.fullWell * std::max(0.0, x) / full;
  const double variance = electrons + camera.readNoise * camera.readNoise;
  return (electrons + std::sqrt(variance) * normal(random)) * full / camera.fullWell;
}

image::Image exposed(const image::Image& radiance, const image::Image& alpha, const StageExposure& camera,
                     const BracketShot& shot) {
  image::Image picture(alpha.width, alpha.height, 4);
  Random random{shot.seed, shot.view, shot.light, shot.shot};
  for (size_t pixel = 0; pixel < alpha.values.size(); ++pixel) {
    for (size_t c = 0; c < 3; ++c) {
      const double x = camera.seconds[shot.shot] * static_cast<double>(radiance.values[3 * pixel + c]);
      const uint8_t code = codeOf(camera.response, static_cast<float>(sensed(x, camera, random)));
      picture.values[4 * pixel + c] = static_cast<float>(code) / 255;
    }
    picture.values[4 * pixel + 3] = alpha.values[pixel];
  }
  return picture;
}

namespace {

constexpr size_t kMostTimes = 16;

template <class Curve> image::Response responseOf(Curve curve) {
  image::Response response;
  for (auto& channel : response.exposure)
    for (size_t code = 0; code < image::Response::codes; ++code) channel[code] = curve(code);
  return response;
}

// Reads 256 non-negative, non-decreasing numbers, the last above 0: the exposures of the codes.
image::Response readResponse(const std::filesystem::path& path) {
  std::istringstream words(readFile(path, 1 << 16));
  words.imbue(std::locale::classic());
  std::vector<float> curve;
  for (float value = 0; curve.size() <= image::Response::codes && words >> value;) {
    if (!(value >= 0 && value <= 1e9f) || (!curve.empty() && value < curve.back()))
      throw Error::mismatch("numbers that do not fall, in 0..1e9", fmt::format("{}", value))
          .at(fmt::format("number {}", curve.size()))
          .in(path);
    curve.push_back(value);
  }
  if (curve.size() != image::Response::codes || !words.eof())
    throw Error::mismatch("256 numbers", fmt::format("{}", curve.size())).in(path);
  if (!(curve.back() > 0)) throw Error::mismatch("a last number above 0", "0").in(path);
  return responseOf([&](size_t code) { return curve[code]; });
}

} // namespace

ExposureSection asExposure(const scene::Entry& entry) {
  const scene::Section s(entry, {"times", "response", "full_well", "read_noise"});
  ExposureSection section;
  StageExposure& camera = section.camera;
  const scene::Entry times = s.require("times");
  for (const scene::Entry& time : scene::asArray(times, "a list of seconds")) {
    camera.seconds.push_back(positive(time));
    if (std::ranges::count(camera.seconds, camera.seconds.back()) > 1)
      throw scene::mismatch(time, "a time of its own");
  }
  if (camera.seconds.empty() || camera.seconds.size() > kMostTimes)
    throw scene::mismatch(times, fmt::format("1 to {} times", kMostTimes));
  const auto response = s.find("response");
  const std::string name = response ? scene::asText(*response) : "srgb";
  camera.isSrgb = name == "srgb";
  if (camera.isSrgb) {
    camera.response =
        responseOf([](size_t code) { return image::linearFromSrgb(static_cast<float>(code) / 255); });
  } else if (name == "gamma") {
    camera.response = responseOf([](size_t code) { return std::pow(static_cast<float>(code) / 255, 2.2f); });
  } else {
    section.files.push_back(scene::asPath(*response));
    camera.response = scene::atFile(*response, [&] { return readResponse(section.files.back()); });
  }
  if (const auto fullWell = s.find("full_well")) camera.fullWell = numberIn(*fullWell, 1, 1e9);
  if (const auto readNoise = s.find("read_noise")) {
    if (!(camera.fullWell > 0)) throw scene::mismatch(*readNoise, "full_well beside it");
    camera.readNoise = numberIn(*readNoise, 0, 1e9);
  }
  return section;
}

} // namespace surflect::stage
