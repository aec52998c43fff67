#include "srf/image/resize.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <limits>
#include <span>

namespace surflect::image {

namespace {

// Calls add(from, share) for the cells of a row of `from` cells that overlap cell `i` of `to` cells of the
// same total length; shares sum to 1.
template <class Add> void forCellsUnder(int i, int to, int from, const Add& add) {
  const double scale = static_cast<double>(from) / to, begin = i * scale, end = (i + 1) * scale;
  for (int j = static_cast<int>(begin); j < from && j < end; ++j)
    add(j, static_cast<float>((std::min(end, j + 1.0) - std::max(begin, 1.0 * j)) / scale));
}

} // namespace

Image resampled(const Image& image, const PixelWindow& window, int width, int height) {
  assert(width > 0 && height > 0 && window.width() > 0 && window.height() > 0);
  const auto addTo = [](std::span<float> sum, float share, std::span<const float> pixel) {
    for (size_t c = 0; c < sum.size(); ++c) sum[c] += share * pixel[c];
  };
  Image rows(width, window.height(), image.channels), result(width, height, image.channels);
  for (int y = 0; y < rows.height; ++y)
    for (int x = 0; x < width; ++x)
      forCellsUnder(x, width, window.width(), [&](int from, float share) {
        addTo(rows.at(x, y), share, image.at(window.x0 + from, window.y0 + y));
      });
  for (int y = 0; y < height; ++y)
    forCellsUnder(y, height, window.height(), [&](int from, float share) {
      for (int x = 0; x < width; ++x) addTo(result.at(x, y), share, rows.at(x, from));
    });
  return result;
}

Image squareMeans(const Image& image, int side) {
  assert(side > 0);
  Image result(image.width / side, image.height / side, image.channels);
  for (int y = 0; y < result.height * side; ++y)
    for (int x = 0; x < result.width * side; ++x) {
      const std::span<const float> from = image.at(x, y);
      const std::span<float> to = result.at(x / side, y / side);
      for (size_t c = 0; c < to.size(); ++c) to[c] += from[c];
    }
  for (float& value : result.values) value /= static_cast<float>(side * side);
  return result;
}

Image squareMinima(const Image& image, int side) {
  assert(side > 0);
  Image result(image.width / side, image.height / side, image.channels);
  std::ranges::fill(result.values, std::numeric_limits<float>::infinity());
  for (int y = 0; y < result.height * side; ++y)
    for (int x = 0; x < result.width * side; ++x) {
      const std::span<const float> from = image.at(x, y);
      const std::span<float> to = result.at(x / side, y / side);
      for (size_t c = 0; c < to.size(); ++c) to[c] = std::min(to[c], from[c]);
    }
  return result;
}

} // namespace surflect::image
