#include "render/coverage.h"

#include "surfel/error.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace surflect {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A splat at a pixel. Its colour is weighted by the Gaussian, but the area it covers is spread by a wider
// kernel of the same mass: sums of that hardly ripple, even where the cloud has lost a surfel, and its area
// is right wherever in a pixel a tiny splat falls.
struct Fragment {
  float order, tolerance, area;
  uint32_t splat; // of the tile
};

// (1 - q/Q)^2, Q the square of the cut-off, scaled to the mass of exp(-q/2): 6/Q at its peak; their integrals
// over the plane are pi Q / 3 and 2 pi.
constexpr float kAreaPeak = static_cast<float>(6 / (kCutoffSigmas * kCutoffSigmas));

float saturated(float area) { return std::clamp((area - (1 - kFull)) / (2 * kFull - 1), 0.f, 1.f); }

struct Layer {
  size_t begin, end; // of the sorted fragments
  float area;
  float alpha; // of the pixel up to here, less that before
};

// Divides the fragments of one pixel, nearest first, into layers, down to the one that fills it.
//
// A layer ends where the depth interval of the next fragment no longer touches the ones so far. Areas are
// parts of one pixel, so those of layers add up: with S_k the area of layers 1 to k, layer k is given
//   alpha_k = saturated(S_k) - saturated(S_k-1),
// shared among its fragments by weight. A surface behind an edge fills exactly what the edge leaves open, and
// a surface that falls apart into two layers (grazing, creased or noisy) still adds up to 1. The usual
// alpha_k (1 - alpha) would let the background through there.
void layersOf(const std::vector<Fragment>& fragments, std::vector<Layer>& layers) {
  layers.clear();
  float area = 0, alpha = 0;
  for (size_t begin = 0, end; begin < fragments.size() && alpha < 1; begin = end) {
    float layerArea = 0, back = -kInfinity;
    for (end = begin; end < fragments.size(); ++end) {
      const Fragment& f = fragments[end];
      if (end > begin && f.order - f.tolerance > back) break;
      if (layerArea < kRooted) back = std::max(back, f.order + f.tolerance);
      layerArea += f.area;
    }
    area += layerArea;
    const float alphaBefore = std::exchange(alpha, saturated(area));
    layers.push_back({begin, end, layerArea, alpha - alphaBefore});
  }
}

// More fragments than this in a pixel are not compared each with each.
constexpr size_t kManyFragments = 2048;

float weightAt(const TileSplat& s, float x, float y) {
  const float a = s.a0 + s.ax * x + s.ay * y, b = s.b0 + s.by * y;
  return s.peak * std::exp(-0.5f * (a * a + b * b));
}

// Reused from tile to tile.
struct Scratch {
  std::vector<float> orders, areas, tolerances; // BlockFragments
  std::vector<uint32_t> reached;
  std::vector<float> ofPixel;      // PixelFragments
  std::vector<uint8_t> seen;       // splats of a tile
  std::vector<Fragment> fragments; // of a pixel
  std::vector<Layer> layers;

  BlockFragments blockFragments(size_t count) {
    if (tolerances.size() < count + kLanes) {
      tolerances.resize(2 * count + kLanes);
      reached.resize(tolerances.size());
      orders.resize(tolerances.size() * kLanes);
      areas.resize(tolerances.size() * kLanes);
      ofPixel.resize(4 * (tolerances.size() + kLanes));
    }
    return {orders.data(), areas.data(), tolerances.data(), reached.data()};
  }
  PixelFragments pixelFragments() {
    const size_t room = ofPixel.size() / 4;
    const auto part = [&](size_t i) { return &ofPixel[i * room]; };
    return {part(0), part(1), part(2), part(3)};
  }
};

// The fragments of a pixel, nearest first; those of one depth in the order of the block's list.
void sortPixel(const SplatKernels& kernels, const TileLists& lists, int block, int lane, uint32_t count,
               const BlockFragments& ofBlock, const PixelFragments& pixel, std::vector<Fragment>& sorted) {
  constexpr uint32_t none = std::numeric_limits<uint32_t>::max();
  sorted.assign(count, {0, 0, 0, none});
  const bool ranked = count <= kManyFragments;
  if (ranked) kernels.rankPixel(count, pixel);
  const uint32_t begin = lists.begin[block];
  for (uint32_t i = 0, entry = 0; i < count; ++entry) {
    if ((ofBlock.reached[entry] >> lane & 1) == 0) continue;
    auto place = ranked ? static_cast<uint32_t>(pixel.work[i]) : i;
    while (sorted[place].splat != none) ++place; // taken by one of the same depth
    sorted[place] = {pixel.order[i], pixel.tolerance[i], pixel.area[i], lists.list[begin + entry]};
    ++i;
  }
  if (!ranked) std::ranges::stable_sort(sorted, {}, &Fragment::order);
}

// The layers of a pixel that the kernel left open: a single one goes to `block`, more to the tile.
void resolvePixel(CoverageTile& tile, int block, int lane, Scratch& scratch, BlockLayers& layers) {
  const TileLists& lists = tile.lists;
  const std::vector<Fragment>& fragments = scratch.fragments;
  layersOf(fragments, scratch.layers);

  float area = 0;
  size_t visibleLayers = 0;
  for (const Layer& layer : scratch.layers) {
    area += layer.area;
    visibleLayers += layer.alpha > 0;
  }
  const Layer& first = scratch.layers.front();
  layers.alpha[lane] = saturated(area);
  layers.area[lane] = first.area;
  layers.limit[lane] = first.end < fragments.size() ? fragments[first.end].order : kInfinity;
  if (visibleLayers == 1 && first.alpha > 0) return;

  layers.limit[lane] = -kInfinity;
  const int blockX = block % kBlocksPerRow * kBlockSize, blockY = block / kBlocksPerRow * kBlockSize;
  const int x = blockX + lane % kBlockSize, y = blockY + lane / kBlockSize;
  LayeredPixel pixel{static_cast<uint32_t>(y * kTileSize + x),
                     static_cast<uint32_t>(tile.contributions.size()), 0, 0};
  const auto fromMiddle = [](int i) { return static_cast<float>(i - kTileSize / 2) + 0.5f; };
  float alpha = 0;
  bool halfway = false;
  for (const Layer& layer : scratch.layers) {
    const size_t begin = tile.contributions.size();
    float weight = 0, weightedOrder = 0;
    for (size_t i = layer.begin; i < layer.end; ++i) {
      const Fragment& f = fragments[i];
      const float w = weightAt(lists.splats[f.splat], fromMiddle(x), fromMiddle(y));
      tile.contributions.push_back({f.splat, w});
      weight += w;
      weightedOrder += w * f.order;
    }
    alpha += layer.alpha;
    if (!halfway && alpha >= layers.alpha[lane] / 2) {
      halfway = true;
      pixel.order = weightedOrder / weight;
      layers.area[lane] = layer.area;
    }
    if (layer.alpha > 0) {
      for (size_t i = begin; i < tile.contributions.size(); ++i)
        tile.contributions[i].weight *= layer.alpha / weight;
    } else {
      tile.contributions.resize(begin);
    }
  }
  pixel.count = static_cast<uint32_t>(tile.contributions.size()) - pixel.begin;
  for (size_t i = pixel.begin; i < tile.contributions.size(); ++i)
    scratch.seen[tile.contributions[i].splat] = 1;
  tile.layered.push_back(pixel);
}

// The pixels of a picture that a tile has.
struct TileFrame {
  int x0, y0, width, height;
};
TileFrame frameOf(const Coverage& coverage, size_t tile) {
  const int tilesX = (coverage.width + kTileSize - 1) / kTileSize;
  const int x = static_cast<int>(tile) % tilesX * kTileSize, y = static_cast<int>(tile) / tilesX * kTileSize;
  return {x, y, std::min(kTileSize, coverage.width - x), std::min(kTileSize, coverage.height - y)};
}

// Calls visit(lane, pixel, count) for the rows of a block: `count` pixels of the picture from `pixel` on.
template <class Visit>
void forRows(const Coverage& coverage, const TileFrame& frame, int block, Visit visit) {
  const int x = block % kBlocksPerRow * kBlockSize, y0 = block / kBlocksPerRow * kBlockSize;
  const int count = std::min(kBlockSize, frame.width - x), rows = std::min(kBlockSize, frame.height - y0);
  for (int row = 0; count > 0 && row < rows; ++row)
    visit(static_cast<size_t>(row * kBlockSize), coverage.pixel(frame.x0 + x, frame.y0 + y0 + row),
          static_cast<size_t>(count));
}

void coverTile(const SplatKernels& kernels, size_t index, Scratch& scratch, Coverage& coverage,
               std::span<uint8_t> seen) {
  CoverageTile& tile = coverage.tiles[index];
  TileLists& lists = tile.lists;
  const TileFrame frame = frameOf(coverage, index);
  size_t entries = 0;
  for (uint32_t i = 0; i < lists.count; ++i) {
    const TileSplat& s = lists.splats[i];
    entries += static_cast<size_t>(s.blockX1 - s.blockX0) * static_cast<size_t>(s.blockY1 - s.blockY0);
  }
  if (entries > std::numeric_limits<uint32_t>::max() / kLanes)
    throw Error::mismatch("at most 2^28 splats over the blocks of a tile", std::to_string(entries));
  tile.list.resize(entries);
  lists.list = tile.list.data();
  kernels.listBlocks(lists);
  tile.limits.resize(size_t{kBlocks} * kLanes);
  scratch.seen.assign(lists.count, 0);

  for (int block = 0; block < kBlocks; ++block) {
    float* limits = &tile.limits[static_cast<size_t>(block) * kLanes];
    const size_t count = lists.end[block] - lists.begin[block];
    if (count == 0) continue;
    const BlockFragments fragments = scratch.blockFragments(count);
    const PixelFragments ofPixel = scratch.pixelFragments();
    BlockLayers layers;
    kernels.resolveBlock(lists, block, frame.width, frame.height, fragments, layers);
    for (uint32_t bits = layers.unresolved; bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      const uint32_t n = kernels.gatherPixel(static_cast<uint32_t>(count), lane, fragments, ofPixel);
      if (n <= kManyFragments && kernels.firstLayer(n, ofPixel, lane, layers)) continue;
      sortPixel(kernels, lists, block, lane, n, fragments, ofPixel, scratch.fragments);
      resolvePixel(tile, block, lane, scratch, layers);
    }
    std::copy_n(layers.limit, kLanes, limits);
    kernels.keepSeen(lists, block, fragments, limits, scratch.seen.data());
    forRows(coverage, frame, block, [&](size_t lane, size_t pixel, size_t pixels) {
      for (size_t i = 0; i < pixels; ++i) {
        coverage.alpha[pixel + i] = layers.alpha[lane + i];
        coverage.layerArea[pixel + i] = layers.area[lane + i];
      }
    });
  }
  for (uint32_t i = 0; i < lists.count; ++i)
    if (scratch.seen[i]) std::atomic_ref(seen[lists.splats[i].splat]).store(1, std::memory_order_relaxed);
}

ProjectJob jobOf(const Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options) {
  const auto scalars = [](const auto& triples) { return reinterpret_cast<const float*>(triples.data()); };
  const Lens& lens = camera.lens;
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

// Splats [begin, end), by the kernel where the lens is one of its kind.
size_t projectSome(const Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options,
                   size_t begin, size_t end, ScreenSplat* out, size_t* rejected) {
  if (camera.lens.model == Lens::Model::pinhole && !camera.lens.distorts())
    return splatKernels(options.simd).project(jobOf(camera, splats, options), begin, end, out, rejected);
  size_t drawn = 0;
  for (size_t i = begin; i < end; ++i) {
    const auto result = footprintOf(camera, splats, i, options);
    if (const auto* footprint = std::get_if<Footprint>(&result)) {
      out[drawn++] = {*footprint, static_cast<uint32_t>(i)};
    } else {
      ++rejected[static_cast<size_t>(std::get<Rejection>(result))];
    }
  }
  return drawn;
}

// Calls visit(tile, x, y) for the tiles under a box, x and y the pixel at its corner.
template <class Visit> void forTiles(const PixelBox& box, int tilesX, Visit visit) {
  for (int y = box.y0 / kTileSize; y <= (box.y1 - 1) / kTileSize; ++y)
    for (int x = box.x0 / kTileSize; x <= (box.x1 - 1) / kTileSize; ++x)
      visit(static_cast<size_t>(y * tilesX + x), x * kTileSize, y * kTileSize);
}

// About the middle of the tile whose corner is the pixel (x, y) of the picture.
TileSplat aboutMiddle(const Footprint& f, uint32_t splat, int x, int y) {
  const float cx = f.x - static_cast<float>(x + kTileSize / 2),
              cy = f.y - static_cast<float>(y + kTileSize / 2);
  const auto block = [](int pixel, int corner) {
    return static_cast<uint8_t>(std::clamp(pixel - corner, 0, kTileSize) / kBlockSize);
  };
  TileSplat s;
  s.ax = std::sqrt(f.xx);
  s.ay = s.ax * f.skew;
  s.a0 = -(s.ax * cx + s.ay * cy);
  s.by = std::sqrt(f.yy);
  s.b0 = -s.by * cy;
  s.peak = f.peak;
  s.areaPeak = f.peak * kAreaPeak;
  s.order0 = f.order - f.orderX * cx - f.orderY * cy;
  s.orderX = f.orderX, s.orderY = f.orderY;
  s.tolerance = f.tolerance;
  s.splat = splat;
  s.blockX0 = block(f.box.x0, x), s.blockX1 = block(f.box.x1 + kBlockSize - 1, x);
  s.blockY0 = block(f.box.y0, y), s.blockY1 = block(f.box.y1 + kBlockSize - 1, y);
  return s;
}

// Projects, and puts each splat into the tiles it touches, in the order of the cloud: a counting sort by
// chunks of the cloud.
void bin(const Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options,
         Coverage& coverage, const Progress& progress) {
  const size_t tiles = coverage.tiles.size();
  const int tilesX = (coverage.width + kTileSize - 1) / kTileSize;
  constexpr size_t kMaxCounters = size_t{1} << 22;
  const size_t chunk = std::max<size_t>(8192, splats.size() / std::max<size_t>(1, kMaxCounters / tiles) + 1);
  const size_t chunks = (splats.size() + chunk - 1) / chunk;

  // Each chunk has room for all its splats, and for the lanes that a kernel may write beyond.
  const auto screen = std::make_unique_for_overwrite<ScreenSplat[]>(chunks * (chunk + kLanes));
  std::vector<size_t> drawn(chunks);
  std::vector<std::array<size_t, 5>> rejected(chunks);
  std::vector<uint32_t> counters(chunks * tiles); // of splats; then where the next one goes, within the tile
  const auto screenOf = [&](size_t c) { return std::span(&screen[c * (chunk + kLanes)], drawn[c]); };
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    progress.checkpoint();
    drawn[c] = projectSome(camera, splats, options, c * chunk, std::min((c + 1) * chunk, splats.size()),
                           &screen[c * (chunk + kLanes)], rejected[c].data());
    for (const ScreenSplat& s : screenOf(c))
      forTiles(s.footprint.box, tilesX, [&](size_t tile, int, int) { ++counters[c * tiles + tile]; });
  });

  for (size_t c = 0; c < chunks; ++c) {
    const auto of = [&](Rejection r) { return rejected[c][static_cast<size_t>(r)]; };
    SplatCounts& counts = coverage.counts;
    counts.drawn += drawn[c];
    counts.dead += of(Rejection::dead);
    counts.notFinite += of(Rejection::notFinite);
    counts.backFacing += of(Rejection::backFacing);
    counts.tooNear += of(Rejection::tooNear);
    counts.outside += of(Rejection::outside);
  }
  std::vector<size_t> begin(tiles + 1);
  for (size_t t = 0; t < tiles; ++t) {
    uint32_t count = 0;
    for (size_t c = 0; c < chunks; ++c) count += std::exchange(counters[c * tiles + t], count);
    coverage.tiles[t].lists.count = count;
    begin[t + 1] = begin[t] + count;
  }
  coverage.splats = std::make_unique_for_overwrite<TileSplat[]>(begin[tiles]);
  for (size_t t = 0; t < tiles; ++t) coverage.tiles[t].lists.splats = &coverage.splats[begin[t]];
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    for (const ScreenSplat& s : screenOf(c))
      forTiles(s.footprint.box, tilesX, [&](size_t tile, int x, int y) {
        coverage.splats[begin[tile] + counters[c * tiles + tile]++] = aboutMiddle(s.footprint, s.splat, x, y);
      });
  });
}

// The marked splats go to coverage.visible, and the tiles' splats point there.
void collectVisible(std::span<const uint8_t> seen, Coverage& coverage) {
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
  const auto rank = std::make_unique_for_overwrite<uint32_t[]>(seen.size());
  tbb::parallel_for(size_t{0}, chunks, [&](size_t c) {
    uint32_t next = begin[c];
    each(c, [&](size_t i) {
      rank[i] = next;
      if (seen[i]) coverage.visible[next++] = static_cast<uint32_t>(i);
    });
  });
  size_t first = 0;
  std::vector<size_t> begins;
  for (const CoverageTile& tile : coverage.tiles) {
    begins.push_back(first);
    first += tile.lists.count;
  }
  tbb::parallel_for(size_t{0}, coverage.tiles.size(), [&](size_t t) {
    for (TileSplat& s : std::span(&coverage.splats[begins[t]], coverage.tiles[t].lists.count))
      s.splat = seen[s.splat] ? rank[s.splat] : std::numeric_limits<uint32_t>::max();
  });
}

// Multiplies the matrix with values, three channels at a time, into every `stride`-th float of the image.
Image multiplied(const Coverage& coverage, std::span<const float> values, int channels, int stride) {
  assert(channels > 0 && values.size() == coverage.visible.size() * static_cast<size_t>(channels));
  const SplatKernels& kernels = splatKernels(coverage.simd);
  Image image(coverage.width, coverage.height, stride);
  tbb::enumerable_thread_specific<std::vector<float>> scratches;
  tbb::parallel_for(size_t{0}, coverage.tiles.size(), [&](size_t index) {
    const CoverageTile& tile = coverage.tiles[index];
    const TileFrame frame = frameOf(coverage, index);
    if (tile.lists.count == 0) return;
    std::vector<float>& ofTile = scratches.local();
    ofTile.resize(4 * size_t{tile.lists.count});
    for (int first = 0; first < channels; first += 3) {
      const auto some = static_cast<size_t>(std::min(3, channels - first));
      for (uint32_t i = 0; i < tile.lists.count; ++i) {
        const uint32_t visible = tile.lists.splats[i].splat;
        if (visible == std::numeric_limits<uint32_t>::max()) continue;
        const float* from =
            &values[size_t{visible} * static_cast<size_t>(channels) + static_cast<size_t>(first)];
        for (size_t k = 0; k < some; ++k) ofTile[4 * size_t{i} + k] = from[k];
      }
      const auto to = [&](size_t pixel) {
        return &image.values[pixel * static_cast<size_t>(stride) + static_cast<size_t>(first)];
      };
      for (int block = 0; block < kBlocks; ++block) {
        if (tile.lists.begin[block] == tile.lists.end[block]) continue;
        float alpha[kLanes] = {}, sums[3 * kLanes];
        forRows(coverage, frame, block, [&](size_t lane, size_t pixel, size_t pixels) {
          for (size_t i = 0; i < pixels; ++i) alpha[lane + i] = coverage.alpha[pixel + i];
        });
        kernels.blendBlock(tile.lists, block, &tile.limits[static_cast<size_t>(block) * kLanes], alpha,
                           ofTile.data(), sums);
        forRows(coverage, frame, block, [&](size_t lane, size_t pixel, size_t pixels) {
          for (size_t i = lane; i < lane + pixels; ++i, ++pixel)
            for (size_t k = 0; k < some; ++k) to(pixel)[k] = sums[k * kLanes + i];
        });
      }
      for (const LayeredPixel& layered : tile.layered) {
        float* pixel = to(coverage.pixel(frame.x0 + static_cast<int>(layered.pixel % kTileSize),
                                         frame.y0 + static_cast<int>(layered.pixel / kTileSize)));
        for (const Contribution& c : std::span(tile.contributions).subspan(layered.begin, layered.count))
          for (size_t k = 0; k < some; ++k) pixel[k] += c.weight * ofTile[4 * size_t{c.splat} + k];
      }
    }
  });
  return image;
}

} // namespace

Coverage cover(const Camera<ObjectSpace>& camera, const Splats& splats, const SplatOptions& options,
               const Progress& progress) {
  const int width = camera.lens.width, height = camera.lens.height;
  assert(width > 0 && height > 0);
  assert(splats.size() <= std::numeric_limits<uint32_t>::max());
  const int tilesX = (width + kTileSize - 1) / kTileSize, tilesY = (height + kTileSize - 1) / kTileSize;
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);

  Coverage coverage;
  coverage.width = width;
  coverage.height = height;
  coverage.lens = camera.lens;
  coverage.simd = options.simd;
  coverage.tiles.resize(static_cast<size_t>(tilesX) * static_cast<size_t>(tilesY));
  coverage.alpha.resize(pixels);
  coverage.layerArea.resize(pixels);

  bin(camera, splats, options, coverage, progress);
  const SplatKernels& kernels = splatKernels(options.simd);
  tbb::enumerable_thread_specific<Scratch> scratches;
  std::vector<uint8_t> seen(splats.size());
  tbb::parallel_for(size_t{0}, coverage.tiles.size(), [&](size_t tile) {
    progress.checkpoint();
    if (coverage.tiles[tile].lists.count > 0) coverTile(kernels, tile, scratches.local(), coverage, seen);
  });
  collectVisible(seen, coverage);
  return coverage;
}

Image blend(const Coverage& coverage, std::span<const float> values, int channels) {
  return multiplied(coverage, values, channels, channels);
}

Image blendWithAlpha(const Coverage& coverage, std::span<const float> values, int channels) {
  Image image = multiplied(coverage, values, channels, channels + 1);
  const auto stride = static_cast<size_t>(image.channels);
  for (size_t pixel = 0; pixel < coverage.alpha.size(); ++pixel)
    image.values[pixel * stride + stride - 1] = coverage.alpha[pixel];
  return image;
}

Image depthImage(const Coverage& coverage) {
  const SplatKernels& kernels = splatKernels(coverage.simd);
  Image image(coverage.width, coverage.height, 1);
  std::ranges::fill(image.values, kInfinity);
  tbb::parallel_for(size_t{0}, coverage.tiles.size(), [&](size_t index) {
    const CoverageTile& tile = coverage.tiles[index];
    const TileFrame frame = frameOf(coverage, index);
    if (tile.lists.count == 0) return;
    const auto put = [&](size_t pixel, float order) {
      image.values[pixel] = static_cast<float>(depthOfOrder(coverage.lens, order));
    };
    for (int block = 0; block < kBlocks; ++block) {
      float orders[kLanes];
      kernels.meanOrder(tile.lists, block, &tile.limits[static_cast<size_t>(block) * kLanes], orders);
      forRows(coverage, frame, block, [&](size_t lane, size_t pixel, size_t pixels) {
        for (size_t i = 0; i < pixels; ++i)
          if (coverage.alpha[pixel + i] > 0) put(pixel + i, orders[lane + i]);
      });
    }
    for (const LayeredPixel& layered : tile.layered)
      put(coverage.pixel(frame.x0 + static_cast<int>(layered.pixel % kTileSize),
                         frame.y0 + static_cast<int>(layered.pixel / kTileSize)),
          layered.order);
  });
  return image;
}

} // namespace surflect
