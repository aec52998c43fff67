#include "bench/plain_splats/slow_coverage.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace surflect::bench::slow {

namespace {

// A splat at a pixel, see pixel_layers.h.
struct Fragment {
  float order, tolerance, weight, area;
  uint32_t splat;
};

// (1 - q/Q)^2, Q the square of the cut-off, scaled to the mass of exp(-q/2); their integrals over the plane
// are pi Q / 3 and 2 pi.
float areaKernel(float q) {
  constexpr float Q = static_cast<float>(splat::kCutoffSigmas * splat::kCutoffSigmas);
  const float t = std::max(0.f, 1 - q / Q);
  return 6 / Q * t * t;
}

// More than these at once, and a tile is split.
constexpr size_t kMaxFragments = size_t(1) << 20;

// Reused from tile to tile.
struct Scratch {
  std::vector<Fragment> drawn;      // splat by splat
  std::vector<uint32_t> drawnPixel; // of each, within the box
  std::vector<Fragment> byPixel;
  std::vector<uint32_t> pixelEnd;
  std::vector<Contribution> contributions;
};

splat::PixelBox intersection(const splat::PixelBox& a, const splat::PixelBox& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

size_t area(const splat::PixelBox& box) {
  return box.empty() ? 0 : static_cast<size_t>(box.x1 - box.x0) * static_cast<size_t>(box.y1 - box.y0);
}

// Calls draw(x, y, fragment) for the pixel centres of the box inside the footprint.
template <class Draw>
void rasterise(const splat::Footprint& f, uint32_t splat, const splat::PixelBox& box, Draw draw) {
  constexpr float cutoff = static_cast<float>(splat::kCutoffSigmas * splat::kCutoffSigmas);
  const splat::PixelBox clipped = intersection(f.box, box);
  for (int y = clipped.y0; y < clipped.y1; ++y) {
    const float dy = static_cast<float>(y) + 0.5f - f.y;
    const float rowQ = f.yy * dy * dy;
    if (!(rowQ <= cutoff)) continue;
    const float middle = f.x - f.skew * dy - 0.5f, half = std::sqrt((cutoff - rowQ) / f.xx);
    const auto bounded = [&](float x) {
      return static_cast<int>(std::clamp(x, float(clipped.x0), float(clipped.x1)));
    };
    const int end = bounded(std::floor(middle + half) + 1);
    for (int x = bounded(std::ceil(middle - half)); x < end; ++x) {
      const float across = static_cast<float>(x) - middle; // dx + skew dy
      const float dx = static_cast<float>(x) + 0.5f - f.x;
      const float q = f.xx * across * across + rowQ;
      const float order = f.order + f.orderX * dx + f.orderY * dy;
      draw(x, y, Fragment{order, f.tolerance, f.peak * std::exp(-q), f.peak * areaKernel(q), splat});
    }
  }
}

float saturated(float area) {
  return std::clamp((area - (1 - splat::kFull)) / (2 * splat::kFull - 1), 0.f, 1.f);
}

struct ResolvedPixel {
  float alpha = 0;
  float order = 0;     // of the layer at half of alpha
  float layerArea = 0; // its sum of areas
};

// Sorts the fragments of one pixel into layers, nearest first, and turns them into contributions.
//
// A layer ends where the depth interval of the next fragment no longer touches the ones so far. Areas are
// parts of one pixel, so those of layers add up: with S_k the area of layers 1 to k, layer k is given
//   alpha_k = saturated(S_k) - saturated(S_k-1),
// shared among its fragments by weight. A surface behind an edge fills exactly what the edge leaves open, and
// a surface that falls apart into two layers (grazing, creased or noisy) still adds up to 1. The usual
// alpha_k (1 - alpha) would let the background through there.
ResolvedPixel resolvePixel(std::span<Fragment> fragments, std::vector<Contribution>& out) {
  std::sort(fragments.begin(), fragments.end(), [](const Fragment& a, const Fragment& b) {
    return a.order != b.order ? a.order < b.order : a.splat < b.splat;
  });
  float area = 0; // S_k; first, that of all layers
  for (const Fragment& f : fragments) area += f.area;
  const float half = saturated(area) / 2;

  ResolvedPixel pixel;
  area = 0;
  for (size_t begin = 0, end; begin < fragments.size() && pixel.alpha < 1; begin = end) {
    float layerArea = 0, weight = 0, weightedOrder = 0;
    float back = -std::numeric_limits<float>::infinity();
    for (end = begin; end < fragments.size(); ++end) {
      const Fragment& f = fragments[end];
      if (end > begin && f.order - f.tolerance > back) break;
      if (layerArea < splat::kRooted) back = std::max(back, f.order + f.tolerance);
      layerArea += f.area;
      weight += f.weight;
      weightedOrder += f.weight * f.order;
    }
    area += layerArea;
    const float alphaBefore = std::exchange(pixel.alpha, saturated(area));
    if (pixel.layerArea == 0 && pixel.alpha >= half) {
      pixel.order = weightedOrder / weight;
      pixel.layerArea = layerArea;
    }
    if (!(pixel.alpha > alphaBefore)) continue;
    const float scale = (pixel.alpha - alphaBefore) / weight;
    for (size_t i = begin; i < end; ++i)
      out.push_back({fragments[i].splat, fragments[i].weight * scale, i + 1 == end});
  }
  return pixel;
}

// Draws a box of one tile. Boxes with too many fragments are halved first; pixels do not notice.
void coverBox(const capture::Lens& lens, std::span<const splat::Footprint> footprints,
              std::span<const uint32_t> splats, const splat::PixelBox& box, Scratch& scratch,
              SplatRaster& coverage) {
  size_t fragmentBound = 0;
  for (const uint32_t splat : splats) fragmentBound += area(intersection(footprints[splat].box, box));
  if (fragmentBound > kMaxFragments && area(box) > 1) {
    splat::PixelBox a = box, b = box;
    if (box.x1 - box.x0 > box.y1 - box.y0) {
      a.x1 = b.x0 = (box.x0 + box.x1) / 2;
    } else {
      a.y1 = b.y0 = (box.y0 + box.y1) / 2;
    }
    coverBox(lens, footprints, splats, a, scratch, coverage);
    coverBox(lens, footprints, splats, b, scratch, coverage);
    return;
  }

  scratch.drawn.clear();
  scratch.drawnPixel.clear();
  scratch.pixelEnd.assign(area(box), 0);
  const auto pixelInBox = [&](int x, int y) {
    return static_cast<uint32_t>((y - box.y0) * (box.x1 - box.x0) + x - box.x0);
  };
  for (const uint32_t splat : splats)
    rasterise(footprints[splat], splat, box, [&](int x, int y, const Fragment& fragment) {
      scratch.drawn.push_back(fragment);
      scratch.drawnPixel.push_back(pixelInBox(x, y));
      ++scratch.pixelEnd[pixelInBox(x, y)];
    });

  // Counting sort by pixel: pixelEnd holds counts, then begins, then ends.
  uint32_t begin = 0;
  for (uint32_t& count : scratch.pixelEnd) begin += std::exchange(count, begin);
  scratch.byPixel.resize(scratch.drawn.size());
  for (size_t i = 0; i < scratch.drawn.size(); ++i)
    scratch.byPixel[scratch.pixelEnd[scratch.drawnPixel[i]]++] = scratch.drawn[i];

  begin = 0;
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) {
      const uint32_t end = scratch.pixelEnd[pixelInBox(x, y)];
      const auto before = static_cast<uint32_t>(scratch.contributions.size());
      const ResolvedPixel resolved =
          resolvePixel(std::span(scratch.byPixel).subspan(begin, end - begin), scratch.contributions);
      begin = end;

      const size_t pixel = coverage.pixel(x, y);
      coverage.ranges[pixel] = {before, static_cast<uint32_t>(scratch.contributions.size()) - before};
      coverage.alpha[pixel] = resolved.alpha;
      coverage.depth[pixel] = resolved.alpha > 0
                                  ? static_cast<float>(splat::depthOfOrder(lens, resolved.order))
                                  : std::numeric_limits<float>::infinity();
      coverage.layerArea[pixel] = resolved.layerArea;
    }
}

// Footprints per splat; those not drawn have an empty box.
std::vector<splat::Footprint> project(const capture::Camera<ObjectSpace>& camera, const splat::Splats& splats,
                                      const splat::SplatOptions& options, splat::SplatCounts& counts,
                                      const Progress& progress) {
  constexpr uint8_t drawn = 255;
  std::vector<splat::Footprint> footprints(splats.size());
  std::vector<uint8_t> fates(splats.size(), drawn);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, splats.size(), 1024), [&](const auto& range) {
    progress.checkpoint();
    for (size_t i = range.begin(); i < range.end(); ++i) {
      const auto result = splat::footprintOf(camera, splats, i, options);
      if (const auto* footprint = std::get_if<splat::Footprint>(&result)) {
        footprints[i] = *footprint;
      } else {
        fates[i] = static_cast<uint8_t>(std::get<splat::Rejection>(result));
      }
    }
  });
  const auto countOf = [&](auto fate) {
    return static_cast<size_t>(std::count(fates.begin(), fates.end(), static_cast<uint8_t>(fate)));
  };
  counts = {countOf(drawn),
            countOf(splat::Rejection::dead),
            countOf(splat::Rejection::notFinite),
            countOf(splat::Rejection::backFacing),
            countOf(splat::Rejection::tooNear),
            countOf(splat::Rejection::outside)};
  return footprints;
}

// The splats over each tile, ascending: splats[begin[t] .. begin[t + 1]).
struct TileBins {
  std::vector<size_t> begin;
  std::vector<uint32_t> splats;
};

TileBins binned(std::span<const splat::Footprint> footprints, const SplatRaster& coverage) {
  const auto forTiles = [&](size_t splat, auto visit) {
    constexpr int size = SplatRaster::tileSize;
    const splat::PixelBox& box = footprints[splat].box;
    if (box.empty()) return;
    for (int y = box.y0 / size; y <= (box.y1 - 1) / size; ++y)
      for (int x = box.x0 / size; x <= (box.x1 - 1) / size; ++x) visit(coverage.tile(x * size, y * size));
  };
  TileBins bins;
  bins.begin.assign(coverage.tiles.size() + 2, 0); // shifted by two while filling
  for (size_t i = 0; i < footprints.size(); ++i) forTiles(i, [&](size_t tile) { ++bins.begin[tile + 2]; });
  for (size_t t = 2; t < bins.begin.size(); ++t) bins.begin[t] += bins.begin[t - 1];
  bins.splats.resize(bins.begin.back());
  for (size_t i = 0; i < footprints.size(); ++i)
    forTiles(i, [&](size_t tile) { bins.splats[bins.begin[tile + 1]++] = static_cast<uint32_t>(i); });
  bins.begin.pop_back();
  return bins;
}

} // namespace

SplatRaster rasterize(const capture::Camera<ObjectSpace>& camera, const splat::Splats& splats,
                      const splat::SplatOptions& options, const Progress& progress) {
  const int width = camera.lens.width, height = camera.lens.height;
  assert(width > 0 && height > 0);
  assert(splats.size() <= std::numeric_limits<uint32_t>::max());
  constexpr int size = SplatRaster::tileSize;
  const int tilesX = (width + size - 1) / size, tilesY = (height + size - 1) / size;
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);

  SplatRaster coverage;
  coverage.width = width;
  coverage.height = height;
  coverage.splatCount = splats.size();
  coverage.tiles.resize(static_cast<size_t>(tilesX) * static_cast<size_t>(tilesY));
  coverage.ranges.resize(pixels);
  coverage.alpha.resize(pixels);
  coverage.depth.resize(pixels);
  coverage.layerArea.resize(pixels);

  const std::vector<splat::Footprint> footprints =
      project(camera, splats, options, coverage.counts, progress);
  const TileBins bins = binned(footprints, coverage);
  tbb::enumerable_thread_specific<Scratch> scratches;
  tbb::parallel_for(size_t(0), coverage.tiles.size(), [&](size_t tile) {
    progress.checkpoint();
    Scratch& scratch = scratches.local();
    scratch.contributions.clear();
    const int x = static_cast<int>(tile) % tilesX * size, y = static_cast<int>(tile) / tilesX * size;
    const splat::PixelBox box{x, y, std::min(x + size, width), std::min(y + size, height)};
    const auto over =
        std::span(bins.splats).subspan(bins.begin[tile], bins.begin[tile + 1] - bins.begin[tile]);
    coverBox(camera.lens, footprints, over, box, scratch, coverage);
    coverage.tiles[tile].assign(scratch.contributions.begin(), scratch.contributions.end());
  });
  return coverage;
}

std::vector<uint32_t> visibleSplats(const SplatRaster& coverage) {
  std::vector<uint8_t> seen(coverage.splatCount, 0);
  for (const auto& tile : coverage.tiles)
    for (const Contribution& c : tile) seen[c.splat] = 1;
  std::vector<uint32_t> visible;
  for (size_t i = 0; i < seen.size(); ++i)
    if (seen[i]) visible.push_back(static_cast<uint32_t>(i));
  return visible;
}

image::Image blend(const SplatRaster& coverage, std::span<const float> attributes, int channels,
                   std::span<const float> confidence) {
  assert(channels > 0 && attributes.size() == coverage.splatCount * static_cast<size_t>(channels));
  image::Image image(coverage.width, coverage.height, channels);
  tbb::parallel_for(0, coverage.height, [&](int y) {
    for (int x = 0; x < coverage.width; ++x) {
      const auto pixel = image.at(x, y);
      std::vector<double> sums(pixel.size()); // of a layer
      double alpha = 0, trusted = 0;
      for (const Contribution& c : coverage.at(x, y)) {
        const auto attribute = attributes.subspan(c.splat * pixel.size(), pixel.size());
        const double weight = c.weight * (confidence.empty() ? 1.0 : confidence[c.splat]);
        for (size_t k = 0; k < pixel.size(); ++k) sums[k] += weight * attribute[k];
        alpha += c.weight;
        trusted += weight;
        if (!c.endsLayer) continue;
        for (size_t k = 0; k < pixel.size(); ++k)
          pixel[k] += static_cast<float>(alpha / trusted * std::exchange(sums[k], 0));
        alpha = trusted = 0;
      }
    }
  });
  return image;
}

} // namespace surflect::bench::slow
