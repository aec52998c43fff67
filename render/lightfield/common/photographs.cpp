#include "render/lightfield/common/photographs.h"

#include "srf/image/half_float.h"
#include "srf/image/image.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>

namespace surflect::lightfield {

namespace {

// Half that is finite: NaN becomes 0, infinities the largest half.
uint16_t finiteHalf(float value) {
  if (std::isnan(value)) return 0;
  return image::nearestHalf(std::clamp(value, -65504.f, 65504.f));
}

Eigen::Vector4f floatsOf(const std::array<uint16_t, 4>& pixel) {
  return {image::floatOfHalf(pixel[0]), image::floatOfHalf(pixel[1]), image::floatOfHalf(pixel[2]),
          image::floatOfHalf(pixel[3])};
}

} // namespace

Photographs::Photographs(const Views& views, std::span<const size_t> indices, const Progress& progress)
    : pictures_(indices.size()) {
  std::mutex reporting;
  size_t done = 0;
  tbb::parallel_for(size_t{0}, indices.size(), [&](size_t i) {
    const image::Image image = views.read(indices[i], progress);
    Picture& picture = pictures_[i];
    picture.width = image.width, picture.height = image.height;
    picture.pixels.resize(static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
    for (size_t p = 0; p < picture.pixels.size(); ++p)
      for (size_t channel = 0; channel < 4; ++channel)
        picture.pixels[p][channel] = finiteHalf(image.values[4 * p + channel]);
    const std::lock_guard lock(reporting);
    progress("read photographs", static_cast<double>(++done) / static_cast<double>(indices.size()));
  });
}

Eigen::Vector4f Photographs::at(size_t photograph, capture::Pixel pixel) const {
  const Picture& picture = pictures_[photograph];
  const double x = std::clamp(pixel.x - 0.5, 0., picture.width - 1.);
  const double y = std::clamp(pixel.y - 0.5, 0., picture.height - 1.);
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  const int right = std::min(left + 1, picture.width - 1), bottom = std::min(top + 1, picture.height - 1);
  const auto a = static_cast<float>(x - left), b = static_cast<float>(y - top);
  const auto at = [&](int i, int j) {
    return floatsOf(
        picture.pixels[static_cast<size_t>(j) * static_cast<size_t>(picture.width) + static_cast<size_t>(i)]);
  };
  return (1 - b) * ((1 - a) * at(left, top) + a * at(right, top)) +
         b * ((1 - a) * at(left, bottom) + a * at(right, bottom));
}

} // namespace surflect::lightfield
