#include "bench/splat/splat_times.h"

#include "bench/plain_splats/slow_coverage.h"
#include "render/evaluation/measure.h"
#include "surfel/base/error.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>

namespace surflect::bench {

namespace {

// A fragment at the end of a layer may fall on either side of it, by rounding: its pixel is flipped. Without
// such pixels a picture is as near to the plain one as sums of floats are.
constexpr double kLeastDb = 115, kMostFlipped = 2e-5;
constexpr float kFlipped = 1e-3f;
constexpr int kRoundsToOnePlain = 3;

std::vector<float> ofVisible(const splat::SplatRaster& coverage, const std::vector<float>& colors) {
  std::vector<float> values;
  values.reserve(3 * coverage.visible.size());
  for (const uint32_t i : coverage.visible)
    values.insert(values.end(), colors.begin() + 3 * i, colors.begin() + 3 * i + 3);
  return values;
}

struct Nearness {
  double db = 0, unflippedDb = 0;
  double flipped = 0; // share of the pixels
};
Nearness nearness(const image::Image& a, const image::Image& b) {
  double squared = 0, unflipped = 0;
  size_t flipped = 0;
  for (size_t i = 0; i < a.values.size(); i += 3) {
    double ofPixel = 0;
    bool isFlipped = false;
    for (const size_t k : {i, i + 1, i + 2}) {
      const float difference = a.values[k] - b.values[k];
      ofPixel += difference * difference;
      isFlipped |= !(std::abs(difference) < kFlipped);
    }
    squared += ofPixel;
    unflipped += isFlipped ? 0 : ofPixel;
    flipped += isFlipped;
  }
  const auto values = static_cast<double>(a.values.size());
  const auto decibels = [&](double sum) { return std::min(999.0, evaluation::psnr(sum / values)); };
  return {decibels(squared), decibels(unflipped), static_cast<double>(3 * flipped) / values};
}

struct Way {
  std::string name;
  double db, flipped;
  std::function<void()> cover, blend;
  bool isPlain = false;
};

// The picture is made, and held against the plain one.
Way fastWay(Simd simd, const capture::Camera<ObjectSpace>& camera, const splat::Splats& splats,
            std::span<const float> colors, const image::Image& plain) {
  struct Kept {
    splat::SplatRaster coverage;
    std::vector<float> values;
    image::Image image;
  };
  const auto kept = std::make_shared<Kept>();
  const auto covers = [=, &camera, &splats] {
    kept->coverage = splat::rasterize(camera, splats, {.simd = simd}, {}, std::move(kept->coverage));
  };
  const auto blends = [=] {
    kept->image = splat::blend(kept->coverage, kept->values, 3, {}, std::move(kept->image));
  };
  covers();
  kept->values = ofVisible(kept->coverage, {colors.begin(), colors.end()});
  blends();
  const auto [db, unflippedDb, flipped] = nearness(kept->image, plain);
  if (!(unflippedDb >= kLeastDb && flipped <= kMostFlipped))
    throw Error(fmt::format("splats by {}: {:.1f} dB from plain ones, {:.2g} of the pixels flipped",
                            nameOf(simd), unflippedDb, flipped));
  return {std::string(nameOf(simd)), db, flipped, covers, blends};
}

std::vector<SplatTimes> timesOfWays(std::span<const Way> ways, int rounds) {
  struct Laps {
    std::vector<Lap> cover, blend, both;
  };
  std::vector<Laps> laps(ways.size());
  for (int round = 0; round < rounds; ++round)
    for (size_t i = 0; i < ways.size(); ++i) {
      if (ways[i].isPlain && round % kRoundsToOnePlain != 0) continue;
      const Lap cover = lapOf(ways[i].cover), blend = lapOf(ways[i].blend);
      laps[i].cover.push_back(cover);
      laps[i].blend.push_back(blend);
      laps[i].both.push_back(
          {cover.seconds + blend.seconds, cover.processorSeconds + blend.processorSeconds});
    }
  std::vector<SplatTimes> times(ways.size());
  for (size_t i = 0; i < ways.size(); ++i) {
    times[i].way = ways[i].name;
    times[i].db = ways[i].db;
    times[i].flipped = ways[i].flipped;
    times[i].cover = timesOf(laps[i].cover);
    times[i].blend = timesOf(laps[i].blend);
    times[i].both = timesOf(laps[i].both);
  }
  return times;
}

} // namespace

std::vector<SplatTimes> timeSplats(int rounds) {
  std::vector<SplatTimes> result;
  const auto camera = dollCamera(1024, 768);
  for (const auto order : {SurfelOrder::coherent, SurfelOrder::shuffled}) {
    const DollCloud doll = dollCloud(kDollSurfels, order);
    const splat::Splats splats = splat::splatsOf(doll.rest, doll.deformed);
    slow::SplatRaster plain = slow::rasterize(camera, splats);
    const image::Image image = slow::blend(plain, doll.colors, 3);
    std::vector<Way> ways;
    for (const Simd simd : supportedSimd()) ways.push_back(fastWay(simd, camera, splats, doll.colors, image));
    ways.push_back({"plain", 999, 0, [&] { plain = slow::rasterize(camera, splats); },
                    [&] { slow::blend(plain, doll.colors, 3); }, true});
    const size_t visible = splat::rasterize(camera, splats).visible.size();
    for (const int threads : {1, 2}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                      static_cast<size_t>(threads));
      for (SplatTimes& times : timesOfWays(ways, rounds)) {
        times.order = order;
        times.splats = splats.size();
        times.visible = visible;
        times.threads = threads;
        result.push_back(std::move(times));
      }
    }
  }
  return result;
}

} // namespace surflect::bench
