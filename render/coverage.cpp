#include "render/coverage.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace surflect {

namespace {

TileFrame frameOf(const Coverage& coverage, size_t tile) {
  const int tilesX = tilesAlong(coverage.width);
  const int x = static_cast<int>(tile) % tilesX * kTileSize, y = static_cast<int>(tile) / tilesX * kTileSize;
  return {x, y, std::min(kTileSize, coverage.width - x), std::min(kTileSize, coverage.height - y)};
}

size_t pixelOf(const Coverage& coverage, const TileFrame& frame, const PixelLayer& layered) {
  return coverage.pixel(frame.x0 + static_cast<int>(layered.pixel % kTileSize),
                        frame.y0 + static_cast<int>(layered.pixel / kTileSize));
}

// Calls visit(block) for those of a tile that splats reach.
template <class Visit> void forBlocks(const CoverageTile& tile, Visit visit) {
  for (uint64_t left = tile.blocks; left != 0; left &= left - 1) visit(std::countr_zero(left));
}

// The marked splats go to coverage.visible, and the tiles' splats point there.
void collectVisible(Coverage& coverage) {
  const std::vector<uint8_t>& seen = coverage.seen;
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
  coverage.visible.resize(begin[chunks]);
  uint32_t* rank = coverage.rank.of(seen.size());
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    uint32_t next = begin[c];
    each(c, [&](size_t i) {
      rank[i] = next;
      if (seen[i]) coverage.visible[next++] = static_cast<uint32_t>(i);
    });
  });
  tbb::parallel_for(size_t{0}, coverage.tiles.size(), [&](size_t t) {
    CoverageTile& tile = coverage.tiles[t];
    for (uint32_t& splat : std::span(tile.column.data(), tile.drawn.count))
      splat = seen[splat] ? rank[splat] : 0; // a hidden splat is in no set: what it has is not used
  });
}

// Three values of each of a tile's splats, from `first` on, and 1, times its peak and confidence; returns
// whether all are finite.
bool gatherValues(const CoverageTile& tile, std::span<const float> values, size_t channels, size_t first,
                  std::span<const float> confidence, std::vector<float>& to) {
  constexpr uint32_t kAhead = 16;
  const size_t some = std::min<size_t>(3, channels - first);
  const uint32_t count = tile.drawn.count;
  to.resize(std::max(to.size(), 4 * size_t{count}));
  const float* from = values.data() + first;
  const uint32_t* column = tile.column.data();
  float none = 0; // 0 times what is infinite is no number
  for (uint32_t i = 0; i < count; ++i) {
    __builtin_prefetch(from + column[std::min(i + kAhead, count - 1)] * channels);
    const float* value = from + column[i] * channels;
    const float weight = tile.drawn.splats[i].shape.peak * (confidence.empty() ? 1 : confidence[column[i]]);
    float* out = &to[4 * size_t{i}];
    out[3] = weight;
    if (some == 3) {
      out[0] = weight * value[0], out[1] = weight * value[1], out[2] = weight * value[2];
      none += 0 * out[0] + 0 * out[1] + 0 * out[2];
    } else {
      for (size_t k = 0; k < some; ++k) none += 0 * (out[k] = weight * value[k]);
    }
  }
  return none == 0;
}

// Multiplies the matrix with values, three channels at a time, into every `stride`-th float of the image;
// what remains there is alpha.
Image multiplied(const Coverage& coverage, std::span<const float> values, int channels, int stride,
                 std::span<const float> confidence, Image kept) {
  assert(channels > 0 && values.size() == coverage.visible.size() * static_cast<size_t>(channels));
  assert(confidence.empty() || confidence.size() == coverage.visible.size());
  assert(std::ranges::all_of(confidence, [](float c) { return c > 0; }));
  const SplatKernels& kernels = splatKernels(coverage.simd);
  Image image = std::move(kept);
  image.width = coverage.width, image.height = coverage.height, image.channels = stride;
  image.values.resize(coverage.alpha.size() * static_cast<size_t>(stride));
  tbb::enumerable_thread_specific<std::vector<float>> scratches;
  tbb::parallel_for(size_t{0}, coverage.tiles.size(), [&](size_t index) {
    const CoverageTile& tile = coverage.tiles[index];
    const TileFrame frame = frameOf(coverage, index);
    const auto to = [&](size_t pixel) { return &image.values[pixel * static_cast<size_t>(stride)]; };
    for (int y = frame.y0; y < frame.y0 + frame.height; ++y)
      std::fill_n(to(coverage.pixel(frame.x0, y)), frame.width * stride, 0.f);
    if (tile.blocks == 0 || coverage.visible.empty()) return;
    std::vector<float>& ofTile = scratches.local();
    for (int first = 0; first < channels; first += 3) {
      const int some = std::min(3, channels - first);
      const bool finite = gatherValues(tile, values, static_cast<size_t>(channels),
                                       static_cast<size_t>(first), confidence, ofTile);
      forBlocks(tile, [&](int block) {
        float alpha[kLanes] = {}, sums[3 * kLanes];
        forRows(frame, block, [&](size_t lane, int x, int y, size_t count) {
          copyRow(&coverage.alpha[coverage.pixel(x, y)], count, alpha + lane);
        });
        kernels.blendBlock(tile.drawn, block, tile.limits.data() + static_cast<size_t>(block) * kLanes, alpha,
                           ofTile.data(), finite, sums);
        forRows(frame, block, [&](size_t lane, int x, int y, size_t count) {
          float* out = to(coverage.pixel(x, y)) + first;
          for (size_t i = lane; i < lane + count; ++i, out += stride)
            for (int k = 0; k < some; ++k) out[k] = sums[static_cast<size_t>(k) * kLanes + i];
        });
      });
      for (const PixelLayer& layer : tile.layers) {
        float* out = to(pixelOf(coverage, frame, layer)) + first;
        float sums[3] = {}, sum = 0;
        for (const Contribution& c : std::span(tile.contributions).subspan(layer.begin, layer.count)) {
          const float* value = &ofTile[4 * size_t{c.splat}];
          for (int k = 0; k < some; ++k) sums[k] += c.weight * value[k];
          sum += c.weight * value[3];
        }
        for (int k = 0; k < some; ++k) out[k] += layer.alpha / sum * sums[k];
      }
    }
    for (int y = frame.y0; stride > channels && y < frame.y0 + frame.height; ++y) {
      const size_t pixel = coverage.pixel(frame.x0, y);
      for (int x = 0; x < frame.width; ++x)
        to(pixel)[x * stride + channels] = coverage.alpha[pixel + static_cast<size_t>(x)];
    }
  });
  return image;
}

} // namespace

Coverage cover(const Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options,
               const Progress& progress, Coverage kept) {
  assert(camera.lens.width > 0 && camera.lens.height > 0);
  assert(splats.size() <= std::numeric_limits<uint32_t>::max());

  Coverage coverage = std::move(kept);
  coverage.width = camera.lens.width;
  coverage.height = camera.lens.height;
  coverage.lens = camera.lens;
  coverage.simd = options.simd;
  const size_t pixels = static_cast<size_t>(coverage.width) * static_cast<size_t>(coverage.height);
  coverage.tiles.resize(static_cast<size_t>(tilesAlong(coverage.width)) *
                        static_cast<size_t>(tilesAlong(coverage.height)));
  coverage.alpha.resize(pixels);
  coverage.layerArea.resize(pixels);
  coverage.seen.assign(splats.size(), 0);

  fillTiles(camera, splats, options, progress, coverage.bins);
  coverage.counts = coverage.bins.counts;
  const SplatKernels& kernels = splatKernels(options.simd);
  const PixelSums sums{coverage.alpha.data(), coverage.layerArea.data(), static_cast<size_t>(coverage.width)};
  tbb::enumerable_thread_specific<TileScratch> scratches;
  tbb::parallel_for(size_t{0}, coverage.tiles.size(), [&](size_t tile) {
    progress.checkpoint();
    coverTile(kernels, coverage.bins.screen.data(), coverage.bins.of(tile), frameOf(coverage, tile),
              scratches.local(), coverage.tiles[tile], sums, coverage.seen);
  });
  collectVisible(coverage);
  return coverage;
}

Image blend(const Coverage& coverage, std::span<const float> values, int channels,
            std::span<const float> confidence, Image kept) {
  return multiplied(coverage, values, channels, channels, confidence, std::move(kept));
}

Image blendWithAlpha(const Coverage& coverage, std::span<const float> values, int channels,
                     std::span<const float> confidence, Image kept) {
  return multiplied(coverage, values, channels, channels + 1, confidence, std::move(kept));
}

Image depthImage(const Coverage& coverage) {
  const SplatKernels& kernels = splatKernels(coverage.simd);
  Image image(coverage.width, coverage.height, 1);
  std::ranges::fill(image.values, std::numeric_limits<float>::infinity());
  tbb::parallel_for(size_t{0}, coverage.tiles.size(), [&](size_t index) {
    const CoverageTile& tile = coverage.tiles[index];
    const TileFrame frame = frameOf(coverage, index);
    const auto put = [&](size_t pixel, float order) {
      image.values[pixel] = static_cast<float>(depthOfOrder(coverage.lens, order));
    };
    forBlocks(tile, [&](int block) {
      float orders[kLanes];
      kernels.meanOrder(tile.drawn, block, tile.limits.data() + static_cast<size_t>(block) * kLanes, orders);
      forRows(frame, block, [&](size_t lane, int x, int y, size_t count) {
        const size_t pixel = coverage.pixel(x, y);
        for (size_t i = 0; i < count; ++i)
          if (coverage.alpha[pixel + i] > 0) put(pixel + i, orders[lane + i]);
      });
    });
    for (const PixelLayer& layer : tile.layers)
      if (layer.isMiddle) put(pixelOf(coverage, frame, layer), layer.order);
  });
  return image;
}

} // namespace surflect
