// Splat raster: the splats visible in each pixel, and their weights.
//
// The raster is a sparse matrix, pixels x splats. Multiplying by any attribute of the splats (radiance,
// normal, stretch) gives an image, and the splats worth shading are the non-empty columns. Entries are not
// stored, as recomputing them is faster: each pixel keeps the depth down to which it shows splats.
#pragma once

#include "render/splat/raster_tile.h"
#include "render/splat/splat.h"
#include "render/splat/splat_kernels.h"
#include "srf/image/image.h"
#include "surfel/base/memory.h"
#include "surfel/base/time.h"

#include <cassert>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::splat {

// Bins projected splats by the tiles that they touch.

// Numbers of splats drawn, and of splats rejected for each reason (Rejection).
struct SplatCounts {
  size_t drawn = 0, dead = 0, notFinite = 0, backFacing = 0, tooNear = 0, outside = 0;
};

// Tiles under a splat: from (x0, y0) to (x1, y1), both included.
struct TileRange {
  uint16_t x0, y0, x1, y1;
};

struct TileBins {
  SplatCounts counts;
  ScratchBuffer<ScreenSplat> screen; // drawn splats, with gaps
  ScratchBuffer<TileRange> ranges;   // tiles of each drawn splat, so that filling need not read splats again
  ScratchBuffer<uint32_t> entries;   // indices in `screen`, tile by tile, each in the order of the cloud
  std::vector<size_t> begin;
  std::vector<uint32_t> counters; // working memory of the sort

  std::span<const uint32_t> of(size_t tile) const {
    return {entries.data() + begin[tile], entries.data() + begin[tile + 1]};
  }
};

// Projects the cloud into tiles of kTileSize pixels, row by row. Memory: 72 bytes for each drawn splat, and 4
// for each tile it touches.
void fillTiles(const capture::Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options,
               const Progress& progress, TileBins& bins);

inline int tilesAlong(int pixels) { return (pixels + kTileSize - 1) / kTileSize; }

struct SplatRaster {
  int width = 0, height = 0;
  SplatCounts counts;
  std::vector<uint32_t> visible; // splats with a weight in at least one pixel, ascending
  std::vector<float> alpha;      // per pixel: sum of weights
  std::vector<float> layerArea;  // per pixel: area sum of the layer at half of alpha, about 1 on a surface

  capture::Lens lens;
  std::vector<RasterTile> tiles; // row by row, of kTileSize pixels

  // Working memory of rasterize.
  TileBins bins;
  std::vector<uint8_t> seen;    // one per splat of the cloud
  ScratchBuffer<uint32_t> rank; // index of each splat in `visible`

  size_t pixel(int x, int y) const {
    assert(x >= 0 && y >= 0 && x < width && y < height);
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
};

// Rasterizes the cloud. Fragments of a pixel that agree in depth form a layer; layers fill the pixel front to
// back, each covering area that the layers in front leave open (see layersOf in raster_tile.h). An interior
// pixel has alpha exactly 1, a pixel on a silhouette about its covered area. The result has the same bits for
// any number of threads, and for all instruction sets with fused multiply-add.
//
// Memory: 72 bytes for each drawn splat, 60 for each tile it touches, 5 for each splat of the cloud, 12 for
// each pixel; 28 for each layer of a pixel with several, and 8 for each splat in it; and for each thread up
// to 200 bytes for each splat over one block. `kept`, a raster no longer needed, donates its memory; up to
// four times the needed size is retained.
SplatRaster rasterize(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                      const SplatOptions& options = {}, const Progress& progress = {}, SplatRaster kept = {});

// Blends values, `channels` per visible splat, weighted by the raster; the result is premultiplied by alpha.
// confidence: > 0, one per visible splat; multiplies the splat's weights within each layer of a pixel, which
// are then rescaled to the layer's alpha. Empty if equal for all. `kept`, an image no longer needed, donates
// its memory. Throws Cancelled, as the functions below.
image::Image blend(const SplatRaster& raster, std::span<const float> values, int channels,
                   std::span<const float> confidence = {}, image::Image kept = {},
                   const Progress& progress = {});

// Blends several images at once, which is faster than one by one. Each image states its number of channels;
// the values of a splat are those of the first image, then of the next. Sizes and values of the images are
// overwritten, and their memory is reused.
void blendInto(std::span<image::Image* const> pictures, const SplatRaster& raster,
               std::span<const float> values, std::span<const float> confidence = {},
               const Progress& progress = {});

// As blend, with alpha as an additional channel.
image::Image blendWithAlpha(const SplatRaster& raster, std::span<const float> values, int channels,
                            std::span<const float> confidence = {}, image::Image kept = {},
                            const Progress& progress = {});

// Index in the cloud of the splat of the largest weight at a pixel; empty if the pixel shows none.
std::optional<uint32_t> heaviestSplat(const SplatRaster& raster, int x, int y);

// Depth along the viewing axis, per pixel, of the layer in which half of alpha is reached; infinity if there
// is none. `kept` donates its memory.
image::Image depthImage(const SplatRaster& raster, image::Image kept = {}, const Progress& progress = {});

} // namespace surflect::splat
