#include "srf/import/calibrate.h"

#include "srf/calibration/strengths.h"
#include "srf/calibration/threshold_mask.h"
#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "surfel/error.h"

#include <algorithm>
#include <cassert>

namespace surflect {

namespace {

constexpr int64_t kCalibrationPixels = int64_t{1} << 18; // memory: 12 bytes of each, per photograph

Image radianceOf(const Capture& capture, size_t frame) {
  return std::move(readPhotographs(capture, {&frame, 1}).front().radiance);
}

} // namespace

Image shrunk(const Image& image, int factor) {
  Image small(image.width / factor, image.height / factor, image.channels);
  const float share = 1 / static_cast<float>(factor * factor);
  for (int y = 0; y < small.height * factor; ++y)
    for (int x = 0; x < small.width * factor; ++x) {
      const auto from = image.at(x, y);
      const auto to = small.at(x / factor, y / factor);
      for (size_t c = 0; c < to.size(); ++c) to[c] += share * from[c];
    }
  return small;
}

Mask shrunk(const Mask& mask, int factor) {
  Mask small(mask.width / factor, mask.height / factor);
  std::ranges::fill(small.inside, uint8_t{1});
  for (int y = 0; y < small.height * factor; ++y)
    for (int x = 0; x < small.width * factor; ++x)
      small.inside[static_cast<size_t>(y / factor) * static_cast<size_t>(small.width) +
                   static_cast<size_t>(x / factor)] &=
          mask.inside[static_cast<size_t>(y) * static_cast<size_t>(mask.width) + static_cast<size_t>(x)];
  return small;
}

Mask objectOfView(const Capture& capture, std::span<const size_t> frames, double threshold,
                  const Progress& progress) {
  Image brightest; // largest luminance of all photographs: what the threshold is applied to
  for (const size_t f : frames) {
    progress.checkpoint();
    const Image radiance = radianceOf(capture, f);
    if (brightest.values.empty()) brightest = Image(radiance.width, radiance.height, 1);
    for (size_t i = 0; i < brightest.values.size(); ++i) {
      const float* texel = radiance.values.data() + 3 * i;
      brightest.values[i] = std::max(brightest.values[i], luma({texel[0], texel[1], texel[2]}));
    }
  }
  return objectByThreshold({&brightest, 1}, threshold);
}

StrengthEstimate strengthsInView(const Capture& capture, std::span<const size_t> frames, const Mask& object,
                                 const Progress& progress) {
  int factor = 1;
  while (int64_t{object.width / factor} * (object.height / factor) > kCalibrationPixels) ++factor;
  std::vector<Image> radiance;
  std::vector<Direction3<AcquisitionSpace, double>> towards;
  for (size_t i = 0; i < frames.size(); ++i) {
    progress("light strengths", static_cast<double>(i) / static_cast<double>(frames.size()));
    radiance.push_back(shrunk(radianceOf(capture, frames[i]), factor));
    towards.push_back(
        std::get<DirectionalLight>(capture.lights[*capture.frames[frames[i]].light].kind).towards);
  }
  try {
    return {lightStrengths(radiance, shrunk(object, factor), towards), ""};
  } catch (const Error& e) {
    return {{}, e.what()};
  }
}

} // namespace surflect
