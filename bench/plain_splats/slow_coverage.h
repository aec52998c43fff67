// The splatter of render/splat/splat_raster.h written plainly: footprints in double precision, fragments of a
// pixel gathered and sorted, the matrix stored. What the fast one is held to, and timed beside.
#pragma once

#include "render/splat/splat_raster.h"

namespace surflect::bench::slow {

struct Contribution {
  uint32_t splat; // of the cloud
  float weight;
  bool endsLayer; // it is the last of its layer
};

struct SplatRaster {
  static constexpr int tileSize = 32;

  struct Range {
    uint32_t begin = 0, count = 0;
  };

  int width = 0, height = 0;
  size_t splatCount = 0; // of the cloud
  splat::SplatCounts counts;
  std::vector<std::vector<Contribution>> tiles; // row by row; contributions of the pixels of one tile
  std::vector<Range> ranges;                    // per pixel, into its tile
  std::vector<float> alpha;                     // per pixel: the sum of its weights
  std::vector<float> depth; // per pixel, along the viewing axis, of the layer at half of alpha; else infinity
  std::vector<float> layerArea; // per pixel, of the same layer: its sum of areas, about 1 on a surface

  size_t pixel(int x, int y) const {
    assert(x >= 0 && y >= 0 && x < width && y < height);
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
  size_t tile(int x, int y) const {
    const int tilesPerRow = (width + tileSize - 1) / tileSize;
    return static_cast<size_t>((y / tileSize) * tilesPerRow + x / tileSize);
  }
  // A row of the matrix, front to back.
  std::span<const Contribution> at(int x, int y) const {
    const Range range = ranges[pixel(x, y)];
    return std::span(tiles[tile(x, y)]).subspan(range.begin, range.count);
  }
};

SplatRaster rasterize(const capture::Camera<ObjectSpace>& camera, const splat::Splats& splats,
                      const splat::SplatOptions& options = {}, const Progress& progress = {});

std::vector<uint32_t> visibleSplats(const SplatRaster& coverage);

// attributes: splats x channels, those of one splat together; only those of visible splats are read.
// Returns the sums weighted by coverage, hence premultiplied by alpha. confidence: per splat, see
// render/splat/splat_raster.h.
image::Image blend(const SplatRaster& coverage, std::span<const float> attributes, int channels,
                   std::span<const float> confidence = {});

} // namespace surflect::bench::slow
