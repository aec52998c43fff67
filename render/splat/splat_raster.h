// Which splats a pixel shows, and how much of each: the film before it has colours.
//
// Coverage is a sparse matrix, pixels x splats. Any attribute of the splats (radiance, normal, stretch)
// becomes a picture by multiplication, and the splats worth shading are its non-empty columns. Its entries
// are not stored, which would take longer than to draw them again: a pixel keeps how deep it shows splats.
#pragma once

#include "render/splat/raster_tile.h"
#include "render/splat/splat.h"
#include "render/splat/tile_bins.h"
#include "srf/image/image.h"
#include "surfel/base/progress.h"
#include "surfel/base/scratch_buffer.h"

#include <cassert>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::splat {

struct SplatRaster {
  int width = 0, height = 0;
  SplatCounts counts;
  std::vector<uint32_t> visible; // the splats with a weight in any pixel, ascending
  std::vector<float> alpha;      // per pixel: the sum of its weights
  std::vector<float>
      layerArea; // per pixel, of the layer at half of alpha: its sum of areas, about 1 on a surface

  capture::Lens lens;
  std::vector<RasterTile> tiles; // row by row, of kTileSize pixels

  // Of covering, kept for the next time.
  TileBins bins;
  std::vector<uint8_t> seen;    // of the cloud
  ScratchBuffer<uint32_t> rank; // likewise, in `visible`

  size_t pixel(int x, int y) const {
    assert(x >= 0 && y >= 0 && x < width && y < height);
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
};

// Splats the cloud. Per pixel, fragments that agree in depth form a layer; layers fill the pixel front to
// back, each taking of it what those in front have left (see layersOf in pixel_layers.h). An interior pixel
// has alpha exactly 1, a pixel on a silhouette about its covered area.
// Same bits for any number of threads, and for avx2 and avx512. Memory: 72 bytes for each splat that is
// drawn, 60 for each tile it touches, 5 for each of the cloud, 12 bytes a pixel, 24 for each of several
// layers of a pixel and 8 for each splat in it, and for each thread up to 200 bytes for each splat over one
// block. `kept`, a coverage that is no longer needed, gives its memory: up to four times what is needed
// stays.
SplatRaster rasterize(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                      const SplatOptions& options = {}, const Progress& progress = {}, SplatRaster kept = {});

// values: visible splats x channels, those of one splat together. Returns the sums weighted by coverage,
// hence premultiplied by alpha. confidence: per visible splat, above 0; within a layer of a pixel its weights
// are multiplied by it, and all that the layer fills is shared anew. Empty: the same for all. `kept`, a
// picture that is no longer needed, gives its memory.
image::Image blend(const SplatRaster& coverage, std::span<const float> values, int channels,
                   std::span<const float> confidence = {}, image::Image kept = {});

// Blends several pictures at once, which takes less time than one by one. Each comes with its number of
// channels; a splat's values are those of the first picture, then of the next. Sizes and values of the
// pictures are overwritten, their memory is used again.
void blendInto(std::span<image::Image* const> pictures, const SplatRaster& coverage,
               std::span<const float> values, std::span<const float> confidence = {});

// The same, with alpha as one channel more.
image::Image blendWithAlpha(const SplatRaster& coverage, std::span<const float> values, int channels,
                            std::span<const float> confidence = {}, image::Image kept = {});

// Per pixel, along the viewing axis, of the layer at half of alpha; infinity where there is nothing. `kept`
// gives its memory.
image::Image depthImage(const SplatRaster& coverage, image::Image kept = {});

} // namespace surflect::splat
