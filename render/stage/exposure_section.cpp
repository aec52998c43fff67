#include "render/stage/exposure_section.h"

#include "render/stage/stage_fields.h"
#include "srf/image/color.h"
#include "surfel/base/file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <locale>
#include <sstream>

namespace surflect::stage {

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
