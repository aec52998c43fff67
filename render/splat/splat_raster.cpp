#include "render/splat/splat_raster.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

namespace surflect::splat {

namespace {

ProjectJob jobOf(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                 const SplatOptions& options) {
  const auto scalars = [](const auto& triples) { return reinterpret_cast<const float*>(triples.data()); };
  const capture::Lens& lens = camera.lens;
  ProjectJob job{};
  job.p = scalars(splats.p), job.u = scalars(splats.u), job.v = scalars(splats.v);
  job.handedness = reinterpret_cast<const int8_t*>(splats.handedness.data());
  job.radius = splats.radius.data(), job.coverage = splats.coverage.data();
  for (int i = 0; i < 9; ++i) job.rotation[i] = camera.cameraFromWorld.rotation()(i / 3, i % 3);
  for (int i = 0; i < 3; ++i) job.translation[i] = camera.cameraFromWorld.translation()[i];
  job.focalX = lens.focalX, job.focalY = lens.focalY, job.centerX = lens.centerX, job.centerY = lens.centerY;
  job.width = lens.width, job.height = lens.height;
  job.sigmaPerRadius = kSigmaPerRadius;
  job.lowPass = static_cast<float>(options.lowPass), job.nearDepth = static_cast<float>(options.nearDepth);
  return job;
}

ScreenSplat screenSplatOf(const Footprint& f, uint32_t splat) {
  constexpr auto cutoff = static_cast<float>(kCutoffSigmas);
  const float ax = std::sqrt(f.xx) / cutoff, by = std::sqrt(f.yy) / cutoff;
  return {{ax, ax * f.skew, by, f.peak, f.peak * kAreaPeak, f.orderX, f.orderY, f.tolerance},
          f.x,
          f.y,
          f.order,
          splat,
          f.box};
}

// Projects splats [begin, end), by the vector kernel if it supports the lens.
size_t projectSome(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                   const SplatOptions& options, size_t begin, size_t end, ScreenSplat* out,
                   size_t* rejected) {
  if (camera.lens.model == capture::Lens::Model::pinhole && !camera.lens.distorts())
    return projectSplats(jobOf(camera, splats, options), begin, end, out, rejected);
  size_t drawn = 0;
  for (size_t i = begin; i < end; ++i) {
    const auto result = footprintOf(camera, splats, i, options);
    if (const auto* footprint = std::get_if<Footprint>(&result)) {
      out[drawn++] = screenSplatOf(*footprint, static_cast<uint32_t>(i));
    } else {
      ++rejected[static_cast<size_t>(std::get<Rejection>(result))];
    }
  }
  return drawn;
}

TileRange rangeOf(const PixelBox& box) {
  const auto tile = [](int pixel) { return static_cast<uint16_t>(pixel / kTileSize); };
  return {tile(box.x0), tile(box.y0), tile(box.x1 - 1), tile(box.y1 - 1)};
}

// Calls visit(tile) for each tile of a range.
template <class Visit> void forTiles(const TileRange& range, int tilesX, Visit visit) {
  for (int y = range.y0; y <= range.y1; ++y)
    for (int x = range.x0; x <= range.x1; ++x) visit(static_cast<size_t>(y * tilesX + x));
}

} // namespace

// Counting sort by chunks of the cloud.
void fillTiles(const capture::Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options,
               const Progress& progress, TileBins& bins) {
  const int tilesX = tilesAlong(camera.lens.width);
  const auto tiles = static_cast<size_t>(tilesX) * static_cast<size_t>(tilesAlong(camera.lens.height));
  constexpr size_t kMaxCounters = size_t{1} << 22;
  const size_t chunk = std::max<size_t>(8192, splats.size() / std::max<size_t>(1, kMaxCounters / tiles) + 1);
  const size_t chunks = (splats.size() + chunk - 1) / chunk;

  assert(chunks * chunk <= std::numeric_limits<uint32_t>::max());
  assert(std::max(camera.lens.width, camera.lens.height) <= kTileSize << 16);
  ScreenSplat* screen = bins.screen.of(chunks * chunk); // each chunk has room for all its splats
  TileRange* ranges = bins.ranges.of(chunks * chunk);
  std::vector<size_t> drawn(chunks);
  std::vector<std::array<size_t, 5>> rejected(chunks);
  bins.counters.assign(chunks * tiles, 0); // splats per tile; then offsets within the tile
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    progress.checkpoint();
    drawn[c] = projectSome(camera, splats, options, c * chunk, std::min((c + 1) * chunk, splats.size()),
                           screen + c * chunk, rejected[c].data());
    uint32_t* counters = &bins.counters[c * tiles];
    for (size_t i = c * chunk; i < c * chunk + drawn[c]; ++i) {
      ranges[i] = rangeOf(screen[i].box);
      forTiles(ranges[i], tilesX, [&](size_t tile) { ++counters[tile]; });
    }
  });

  bins.counts = {};
  for (size_t c = 0; c < chunks; ++c) {
    const auto of = [&](Rejection r) { return rejected[c][static_cast<size_t>(r)]; };
    SplatCounts& counts = bins.counts;
    counts.drawn += drawn[c];
    counts.dead += of(Rejection::dead);
    counts.notFinite += of(Rejection::notFinite);
    counts.backFacing += of(Rejection::backFacing);
    counts.tooNear += of(Rejection::tooNear);
    counts.outside += of(Rejection::outside);
  }
  std::vector<uint32_t> counts(tiles);
  for (size_t c = 0; c < chunks; ++c)
    for (size_t t = 0; t < tiles; ++t) counts[t] += std::exchange(bins.counters[c * tiles + t], counts[t]);
  bins.begin.assign(tiles + 1, 0);
  for (size_t t = 0; t < tiles; ++t) bins.begin[t + 1] = bins.begin[t] + counts[t];

  uint32_t* entries = bins.entries.of(bins.begin[tiles]);
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    uint32_t* counters = &bins.counters[c * tiles];
    for (size_t i = c * chunk; i < c * chunk + drawn[c]; ++i)
      forTiles(ranges[i], tilesX,
               [&](size_t tile) { entries[bins.begin[tile] + counters[tile]++] = static_cast<uint32_t>(i); });
  });
}

namespace {

TileFrame frameOf(const SplatRaster& raster, size_t tile) {
  const int tilesX = tilesAlong(raster.width);
  const int x = static_cast<int>(tile) % tilesX * kTileSize, y = static_cast<int>(tile) / tilesX * kTileSize;
  return {x, y, std::min(kTileSize, raster.width - x), std::min(kTileSize, raster.height - y)};
}

size_t pixelOf(const SplatRaster& raster, const TileFrame& frame, const PixelLayer& layered) {
  return raster.pixel(frame.x0 + static_cast<int>(layered.pixel % kTileSize),
                      frame.y0 + static_cast<int>(layered.pixel / kTileSize));
}

// Calls visit(block) for each block of a tile that splats reach.
template <class Visit> void forBlocks(const RasterTile& tile, Visit visit) {
  for (uint64_t left = tile.blocks; left != 0; left &= left - 1) visit(std::countr_zero(left));
}

// Collects the marked splats in raster.visible, and makes the tiles refer to splats by their indices there.
void collectVisible(SplatRaster& raster) {
  const std::vector<uint8_t>& seen = raster.seen;
  constexpr size_t chunk = 16384;
  const size_t chunks = (seen.size() + chunk - 1) / chunk;
  const auto each = [&](size_t c, auto visit) {
    for (size_t i = c * chunk; i < std::min((c + 1) * chunk, seen.size()); ++i) visit(i);
  };
  std::vector<uint32_t> begin(chunks + 1);
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    uint32_t count = 0;
    each(c, [&](size_t i) { count += seen[i]; });
    begin[c + 1] = count;
  });
  for (size_t c = 0; c < chunks; ++c) begin[c + 1] += begin[c];
  raster.visible.resize(begin[chunks]);
  uint32_t* rank = raster.rank.of(seen.size());
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    uint32_t next = begin[c];
    each(c, [&](size_t i) {
      rank[i] = next;
      if (seen[i]) raster.visible[next++] = static_cast<uint32_t>(i);
    });
  });
  tbb::parallel_for(size_t{0}, raster.tiles.size(), [&](size_t t) {
    RasterTile& tile = raster.tiles[t];
    for (uint32_t& splat : std::span(tile.column.data(), tile.drawn.count))
      splat = seen[splat] ? rank[splat] : 0; // a hidden splat is in no set, so its entry is unused
  });
}

constexpr size_t kMostTriples = 2; // groups of three channels summed by one call of blendBlock

// Gathers `channelCount` values for each splat of a tile, from channel `first` on, in the layout of
// blendBlock: one group for up to three channels, two for more. Returns true if all are finite.
bool gatherValues(const RasterTile& tile, std::span<const float> values, size_t channels, size_t first,
                  size_t channelCount, std::span<const float> confidence, std::vector<float>& to) {
  constexpr uint32_t kAhead = 16;
  const size_t stride = channelCount > 3 ? 8 : 4;
  const uint32_t count = tile.drawn.count;
  to.resize(std::max(to.size(), stride * count));
  const float* from = values.data() + first;
  const uint32_t* column = tile.column.data();
  float none = 0; // sum of 0 times each value: NaN if a value is not finite
  for (uint32_t i = 0; i < count; ++i) {
    __builtin_prefetch(from + column[std::min(i + kAhead, count - 1)] * channels);
    const float* value = from + column[i] * channels;
    const float weight = tile.drawn.splats[i].shape.peak * (confidence.empty() ? 1 : confidence[column[i]]);
    float* out = &to[stride * i];
    out[3] = weight;
    for (size_t k = 0; k < channelCount; ++k) none += 0 * (out[k / 3 * 4 + k % 3] = weight * value[k]);
  }
  return none == 0;
}

// A channel of an image: its value at pixel i is first[i * stride].
struct Plane {
  float* first;
  size_t stride;
};

// Gives an image the size of the raster; the caller must overwrite all values.
void fit(image::Image& picture, const SplatRaster& raster, int channels) {
  picture.width = raster.width, picture.height = raster.height, picture.channels = channels;
  picture.values.resize(raster.alpha.size() * static_cast<size_t>(channels));
}

void clear(image::Image& picture, const TileFrame& frame, float value) {
  for (int y = frame.y0; y < frame.y0 + frame.height; ++y)
    std::fill_n(picture.at(frame.x0, y).data(), frame.width * picture.channels, value);
}

// Multiplies the matrix with values, six channels at a time. The products go to the images' channels in
// succession; an extra last channel receives alpha.
void multiply(std::span<image::Image* const> pictures, const SplatRaster& raster,
              std::span<const float> values, size_t channels, std::span<const float> confidence,
              const Progress& progress) {
  assert(channels > 0 && values.size() == raster.visible.size() * channels);
  assert(confidence.empty() || confidence.size() == raster.visible.size());
  assert(std::ranges::all_of(confidence, [](float c) { return c > 0; }));
  std::vector<Plane> planes;
  for (image::Image* picture : pictures) {
    fit(*picture, raster, picture->channels);
    const auto stride = static_cast<size_t>(picture->channels);
    for (size_t k = 0; k < stride; ++k) planes.push_back({picture->values.data() + k, stride});
  }
  assert(planes.size() == channels || planes.size() == channels + 1);
  tbb::enumerable_thread_specific<std::vector<float>> scratches;
  tbb::parallel_for(size_t{0}, raster.tiles.size(), [&](size_t index) {
    progress.checkpoint();
    const RasterTile& tile = raster.tiles[index];
    const TileFrame frame = frameOf(raster, index);
    for (image::Image* picture : pictures) clear(*picture, frame, 0);
    if (tile.blocks == 0 || raster.visible.empty()) return;
    std::vector<float>& ofTile = scratches.local();
    for (size_t first = 0; first < channels; first += 3 * kMostTriples) {
      const size_t channelCount = std::min(3 * kMostTriples, channels - first);
      const int triples = channelCount > 3 ? 2 : 1;
      const std::span to = std::span(planes).subspan(first, channelCount);
      const bool finite = gatherValues(tile, values, channels, first, channelCount, confidence, ofTile);
      forBlocks(tile, [&](int block) {
        float alpha[kLanes] = {}, sums[3 * kMostTriples * kLanes];
        forRows(frame, block, [&](size_t lane, int x, int y, size_t count) {
          copyRow(&raster.alpha[raster.pixel(x, y)], count, alpha + lane);
        });
        blendBlock(tile.drawn, block, tile.limits.data() + static_cast<size_t>(block) * kLanes, alpha,
                   ofTile.data(), triples, finite, sums);
        forRows(frame, block, [&](size_t lane, int x, int y, size_t count) {
          const size_t pixel = raster.pixel(x, y);
          for (size_t k = 0; k < channelCount; ++k) {
            float* out = to[k].first + pixel * to[k].stride;
            for (size_t i = lane; i < lane + count; ++i, out += to[k].stride) *out = sums[k * kLanes + i];
          }
        });
      });
      for (const PixelLayer& layer : tile.layers) {
        float sums[3 * kMostTriples] = {}, sum = 0;
        for (const Contribution& c : std::span(tile.contributions).subspan(layer.begin, layer.count)) {
          const float* value = &ofTile[4 * static_cast<size_t>(triples) * c.splat];
          for (size_t k = 0; k < channelCount; ++k) sums[k] += c.weight * value[k / 3 * 4 + k % 3];
          sum += c.weight * value[3];
        }
        const size_t pixel = pixelOf(raster, frame, layer);
        for (size_t k = 0; k < channelCount; ++k)
          to[k].first[pixel * to[k].stride] += layer.alpha / sum * sums[k];
      }
    }
    for (int y = frame.y0; planes.size() > channels && y < frame.y0 + frame.height; ++y) {
      const size_t pixel = raster.pixel(frame.x0, y);
      const auto [alpha, stride] = planes.back();
      for (size_t x = pixel; x < pixel + static_cast<size_t>(frame.width); ++x)
        alpha[x * stride] = raster.alpha[x];
    }
  });
}

// Gives the raster the size of its lens. Tiles and pixels of a raster that had this size before are kept, for
// rasterizeTile clears what it does not fill.
void fitPixels(SplatRaster& raster) {
  const auto [width, height] = std::pair(raster.lens.width, raster.lens.height);
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  if (raster.width == width && raster.height == height && raster.alpha.size() == pixels) return;
  raster.width = width;
  raster.height = height;
  raster.tiles.resize(static_cast<size_t>(tilesAlong(width)) * static_cast<size_t>(tilesAlong(height)));
  for (RasterTile& tile : raster.tiles) tile.blocks = 0;
  raster.alpha.assign(pixels, 0);
  raster.layerArea.assign(pixels, 0);
}

} // namespace

SplatRaster rasterize(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                      const SplatOptions& options, const Progress& progress, SplatRaster kept) {
  assert(camera.lens.width > 0 && camera.lens.height > 0);
  assert(splats.size() <= std::numeric_limits<uint32_t>::max());

  SplatRaster raster = std::move(kept);
  raster.lens = camera.lens;
  fitPixels(raster);
  raster.seen.assign(splats.size(), 0);

  fillTiles(camera, splats, options, progress, raster.bins);
  raster.counts = raster.bins.counts;
  const PixelSums sums{raster.alpha.data(), raster.layerArea.data(), static_cast<size_t>(raster.width)};
  tbb::enumerable_thread_specific<TileScratch> scratches;
  tbb::parallel_for(size_t{0}, raster.tiles.size(), [&](size_t tile) {
    progress.checkpoint();
    rasterizeTile(raster.bins.screen.data(), raster.bins.of(tile), frameOf(raster, tile),
                  options.searchLayers, options.keepsHidden, scratches.local(), raster.tiles[tile], sums,
                  raster.seen);
  });
  collectVisible(raster);
  return raster;
}

void blendInto(std::span<image::Image* const> pictures, const SplatRaster& raster,
               std::span<const float> values, std::span<const float> confidence, const Progress& progress) {
  size_t channels = 0;
  for (const image::Image* picture : pictures) channels += static_cast<size_t>(picture->channels);
  multiply(pictures, raster, values, channels, confidence, progress);
}

image::Image blend(const SplatRaster& raster, std::span<const float> values, int channels,
                   std::span<const float> confidence, image::Image kept, const Progress& progress) {
  kept.channels = channels;
  image::Image* const picture = &kept;
  multiply(std::span(&picture, 1), raster, values, static_cast<size_t>(channels), confidence, progress);
  return kept;
}

image::Image blendWithAlpha(const SplatRaster& raster, std::span<const float> values, int channels,
                            std::span<const float> confidence, image::Image kept, const Progress& progress) {
  kept.channels = channels + 1;
  image::Image* const picture = &kept;
  multiply(std::span(&picture, 1), raster, values, static_cast<size_t>(channels), confidence, progress);
  return kept;
}

std::optional<uint32_t> heaviestSplat(const SplatRaster& raster, int x, int y) {
  if (!(raster.alpha[raster.pixel(x, y)] > 0)) return std::nullopt;
  const auto tile = static_cast<size_t>(y / kTileSize * tilesAlong(raster.width) + x / kTileSize);
  const auto splat = heaviestSplat(raster.tiles[tile], x % kTileSize, y % kTileSize);
  return splat ? std::optional(raster.visible[*splat]) : std::nullopt;
}

image::Image depthImage(const SplatRaster& raster, image::Image kept, const Progress& progress) {
  image::Image image = std::move(kept);
  fit(image, raster, 1);
  tbb::parallel_for(size_t{0}, raster.tiles.size(), [&](size_t index) {
    progress.checkpoint();
    const RasterTile& tile = raster.tiles[index];
    const TileFrame frame = frameOf(raster, index);
    clear(image, frame, std::numeric_limits<float>::infinity());
    const auto put = [&](size_t pixel, float order) {
      image.values[pixel] = static_cast<float>(depthOfOrder(raster.lens, order));
    };
    forBlocks(tile, [&](int block) {
      float orders[kLanes];
      meanOrder(tile.drawn, block, tile.limits.data() + static_cast<size_t>(block) * kLanes, orders);
      forRows(frame, block, [&](size_t lane, int x, int y, size_t count) {
        const size_t pixel = raster.pixel(x, y);
        for (size_t i = 0; i < count; ++i)
          if (raster.alpha[pixel + i] > 0) put(pixel + i, orders[lane + i]);
      });
    });
    for (const PixelLayer& layer : tile.layers)
      if (layer.isMedian) put(pixelOf(raster, frame, layer), layer.order);
  });
  return image;
}

} // namespace surflect::splat
