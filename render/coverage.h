// Which splats a pixel shows, and how much of each: the film before it has colours.
//
// Coverage is a sparse matrix, pixels x splats. Any attribute of the splats (radiance, normal, stretch)
// becomes a picture by multiplication, and the splats worth shading are its non-empty columns.
#pragma once

#include "render/splat.h"
#include "srf/image/image.h"
#include "surfel/progress.h"

#include <cassert>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

struct Contribution {
  uint32_t splat;
  float weight;
};

// How many splats were drawn, and why the others were not; see Rejection.
struct SplatCounts {
  size_t drawn = 0, dead = 0, notFinite = 0, backFacing = 0, tooNear = 0, outside = 0;
};

struct Coverage {
  static constexpr int tileSize = 32;

  struct Range {
    uint32_t begin = 0, count = 0;
  };

  int width = 0, height = 0;
  size_t splatCount = 0; // of the cloud
  SplatCounts counts;
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

// Splats the cloud. Per pixel, fragments that agree in depth form a layer; layers fill the pixel front to
// back, each taking of it what those in front have left (see resolvePixel in the source). An interior pixel
// has alpha exactly 1, a pixel on a silhouette about its covered area.
// Same bits for any number of threads. Memory: 80 bytes a splat, 8 bytes a contribution, and for each thread
// a scratch of at most 100 MiB, or 100 bytes for each splat over one pixel.
Coverage cover(const Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options = {},
               const Progress& progress = {});

// The splats with a weight in any pixel, ascending.
std::vector<uint32_t> visibleSplats(const Coverage& coverage);

// attributes: splats x channels, those of one splat together; only those of visible splats are read.
// Returns the sums weighted by coverage, hence premultiplied by alpha.
Image blend(const Coverage& coverage, std::span<const float> attributes, int channels);

} // namespace surflect
