#include "render/evaluation/tile_errors.h"

#include "render/evaluation/measure.h"
#include "srf/image/mask.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>

namespace surflect::evaluation {

namespace {

double square(double x) { return x * x; }

// Mean square of three channels.
double meanSquare(std::span<const float> a) { return (square(a[0]) + square(a[1]) + square(a[2])) / 3; }
double meanSquare(std::span<const float> a, std::span<const float> b) {
  return (square(double{a[0]} - b[0]) + square(double{a[1]} - b[1]) + square(double{a[2]} - b[2])) / 3;
}

} // namespace

TileErrors relativeErrors(const TileErrors& tiles) {
  TileErrors relative;
  for (size_t tile = 0; tile < tiles.measured.size(); ++tile) {
    const double brightness = tiles.brightness[tile];
    if (!(brightness > 0)) continue;
    relative.measured.push_back(tiles.measured[tile] / brightness);
    relative.predicted.push_back(tiles.predicted[tile] / brightness);
    relative.brightness.push_back(1);
  }
  return relative;
}

TileErrors tileErrors(const image::Image& truth, const image::Image& rendered, const image::Image& predicted,
                      double exposure) {
  assert(predicted.channels == 1 && predicted.width == truth.width && predicted.height == truth.height);
  const image::Mask object =
      validPart(image::unionOf(image::objectMask(truth), image::objectMask(rendered)), truth);
  const image::Image a = applyExposure(truth, exposure), b = applyExposure(rendered, exposure);
  TileErrors tiles;
  for (int top = 0; top < truth.height; top += kTileSize)
    for (int left = 0; left < truth.width; left += kTileSize) {
      double measured = 0, expected = 0, brightness = 0, count = 0;
      for (int y = top; y < std::min(top + kTileSize, truth.height); ++y)
        for (int x = left; x < std::min(left + kTileSize, truth.width); ++x) {
          const auto pixel =
              static_cast<size_t>(y) * static_cast<size_t>(truth.width) + static_cast<size_t>(x);
          if (!object.inside[pixel]) continue;
          measured += meanSquare(a.at(x, y), b.at(x, y));
          brightness += meanSquare(b.at(x, y));
          expected += square(exposure * predicted.values[pixel]);
          ++count;
        }
      if (count < kTileCover * kTileSize * kTileSize) continue;
      tiles.measured.push_back(std::sqrt(measured / count));
      tiles.predicted.push_back(std::sqrt(expected / count));
      tiles.brightness.push_back(std::sqrt(brightness / count));
    }
  return tiles;
}

} // namespace surflect::evaluation
