#include "srf/image/foreign/radiance_header.h"

#include "surfel/error.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

namespace surflect {

namespace {

constexpr size_t kMostLines = 1 << 12;
constexpr std::string_view kExposure = "EXPOSURE=";

double exposureOf(std::string_view line) {
  std::string_view text = line.substr(kExposure.size());
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  if (!(value > 0 && std::isfinite(value)))
    throw Error::mismatch("a number above 0", "'" + std::string(text) + "'").at("EXPOSURE");
  return value;
}

// "-Y 2 +X 4": sign and axis of scanlines, then those of the pixels in them.
RadianceHeader orientationOf(const std::string& line) {
  const size_t second = line.find_first_of("XY", 2);
  const bool known = line.size() > 2 && second != std::string::npos && (line[1] == 'X' || line[1] == 'Y') &&
                     line[1] != line[second];
  const auto isSign = [](char c) { return c == '+' || c == '-'; };
  if (!known || !isSign(line[0]) || !isSign(line[second - 1]))
    throw Error::mismatch("an orientation such as '-Y 2 +X 4'", "'" + line + "'");
  RadianceHeader header;
  header.columns = line[1] == 'X';
  header.upwards = line[header.columns ? second - 1 : 0] == '+';
  header.leftwards = line[header.columns ? 0 : second - 1] == '-';
  return header;
}

} // namespace

RadianceHeader readRadianceHeader(const char* path) {
  std::ifstream file(path, std::ios::binary);
  double exposure = 1;
  std::string line;
  for (size_t i = 0; i < kMostLines && std::getline(file, line) && !line.empty(); ++i)
    if (line.starts_with(kExposure)) exposure *= exposureOf(line);
  if (!std::getline(file, line)) throw Error("the header has no end");
  if (!(exposure > 0 && std::isfinite(exposure)))
    throw Error::mismatch("a product above 0 and within double", "none").at("EXPOSURE");
  RadianceHeader header = orientationOf(line);
  header.exposure = exposure;
  return header;
}

Image asPhotographed(const Image& scanlines, const RadianceHeader& header) {
  const auto factor = static_cast<float>(1 / header.exposure);
  Image image(header.columns ? scanlines.height : scanlines.width,
              header.columns ? scanlines.width : scanlines.height, scanlines.channels);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const int across = header.leftwards ? image.width - 1 - x : x;
      const int down = header.upwards ? image.height - 1 - y : y;
      const auto stored = header.columns ? scanlines.at(down, across) : scanlines.at(across, down);
      std::ranges::transform(stored, image.at(x, y).begin(), [&](float value) { return factor * value; });
    }
  return image;
}

} // namespace surflect
