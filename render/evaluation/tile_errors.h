// True and predicted errors of a picture, tile by tile, by which a prediction of errors is judged.
#pragma once

#include "srf/image/image.h"

#include <vector>

namespace surflect::evaluation {

inline constexpr int kTileSize = 16; // pixels
// Least part of a tile that object pixels of either image cover.
inline constexpr double kTileCover = 0.25;

// Root mean squares over the object pixels of each tile, in row order.
struct TileErrors {
  std::vector<double> measured, predicted; // errors
  std::vector<double> brightness;          // of the rendered colour: the simplest prediction

  TileErrors& operator+=(const TileErrors& other) {
    measured.insert(measured.end(), other.measured.begin(), other.measured.end());
    predicted.insert(predicted.end(), other.predicted.begin(), other.predicted.end());
    brightness.insert(brightness.end(), other.brightness.begin(), other.brightness.end());
    return *this;
  }
};

// Errors divided by brightness, for the tiles that are not black. They show what a prediction knows beyond
// "brighter is worse".
TileErrors relativeErrors(const TileErrors& tiles);

// Tile errors by the protocol of measure.h, in linear light: `truth` and `rendered` are linear RGBA,
// premultiplied; `predicted` is the RMS error of each pixel over its three channels, before the exposure. All
// have one size.
TileErrors tileErrors(const image::Image& truth, const image::Image& rendered, const image::Image& predicted,
                      double exposure);

} // namespace surflect::evaluation
