#include "render/evaluation/tile_errors.h"

#include "render/evaluation/measure.h"
#include "srf/image/mask.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::evaluation {

namespace {

double square(double x) { return x * x; }

// |a - b|^2 of a pixel, over its first three channels.
double squaredDistance(const image::Image& a, const image::Image& b, size_t pixel) {
  const auto channels = static_cast<size_t>(a.channels);
  double sum = 0;
  for (size_t c = 0; c < 3; ++c)
    sum += square(double{a.values[channels * pixel + c]} - b.values[channels * pixel + c]);
  return sum;
}

} // namespace

TileErrors tileErrors(const image::Image& truth, const image::Image& rendered, const image::Image& predicted,
                      double exposure) {
  assert(predicted.channels == 1 && predicted.width == truth.width && predicted.height == truth.height);
  const image::Mask object =
      validPart(image::unionOf(image::objectMask(truth), image::objectMask(rendered)), truth);
  const image::Image a = applyExposure(truth, exposure), b = applyExposure(rendered, exposure);
  TileErrors tiles;
  for (int top = 0; top < truth.height; top += kTileSize)
    for (int left = 0; left < truth.width; left += kTileSize) {
      double measured = 0, expected = 0, count = 0;
      for (int y = top; y < std::min(top + kTileSize, truth.height); ++y)
        for (int x = left; x < std::min(left + kTileSize, truth.width); ++x) {
          const auto pixel =
              static_cast<size_t>(y) * static_cast<size_t>(truth.width) + static_cast<size_t>(x);
          if (!object.inside[pixel]) continue;
          measured += squaredDistance(a, b, pixel) / 3;
          expected += square(exposure * predicted.values[pixel]);
          ++count;
        }
      if (count < kTileCover * kTileSize * kTileSize) continue;
      tiles.measured.push_back(std::sqrt(measured / count));
      tiles.predicted.push_back(std::sqrt(expected / count));
    }
  return tiles;
}

} // namespace surflect::evaluation
