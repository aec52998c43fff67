#include "render/splat/tile_bins.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
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

} // namespace surflect::splat
