// bench_splat [--rounds N] [--slow-rounds N] [--simd NAME]: splats per second at the size of the paper's
// doll, fast and plain interleaved, after checking that both draw the same. As in a film, the fast one keeps
// its memory from one picture to the next. Of vector instructions all kinds, or those of one name.

#include "bench/splat/doll_cloud.h"
#include "bench/splat/slow_coverage.h"
#include "render/measure.h"

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace surflect {
namespace {

// Of the processor, all threads together: what counts where others share the machine.
double milliseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}
double wallMilliseconds() {
  using namespace std::chrono;
  return duration<double, std::milli>(steady_clock::now().time_since_epoch()).count();
}

std::vector<float> ofVisible(const Coverage& coverage, const std::vector<float>& colors) {
  std::vector<float> values;
  values.reserve(3 * coverage.visible.size());
  for (const uint32_t i : coverage.visible)
    values.insert(values.end(), colors.begin() + 3 * i, colors.begin() + 3 * i + 3);
  return values;
}

double decibels(const Image& a, const Image& b) {
  double squared = 0;
  for (size_t i = 0; i < a.values.size(); ++i) squared += std::pow(a.values[i] - b.values[i], 2);
  return psnr(squared / static_cast<double>(a.values.size()));
}

struct Times {
  std::vector<double> cover, blend, wall;
  void print(const char* what, size_t splats) const {
    const auto median = [](std::vector<double> times) {
      std::ranges::sort(times);
      return times[times.size() / 2];
    };
    std::vector<double> sums;
    for (size_t i = 0; i < cover.size(); ++i) sums.push_back(cover[i] + blend[i]);
    const double least = std::ranges::min(sums);
    fmt::print("  {:8} cover {:7.2f}  blend {:6.2f}  both {:7.2f}, least {:7.2f} ms = {:5.1f} M splats/s; "
               "wall {:7.2f}, "
               "least {:7.2f} ms\n",
               what, median(cover), median(blend), median(sums), least,
               static_cast<double>(splats) / least / 1000, median(wall), std::ranges::min(wall));
  }
};

// Coverage and picture of the last round.
struct Kept {
  Coverage coverage;
  Image image;
};

int run(int rounds, int slowRounds, std::string_view only) {
  std::vector<Simd> kinds = supportedSimd();
  if (!only.empty()) std::erase_if(kinds, [&](Simd simd) { return nameOf(simd) != only; });
  if (kinds.empty()) {
    std::fprintf(stderr, "bench_splat: --simd: not of this processor\n");
    return 2;
  }
  const auto camera = dollCamera(1024, 768);
  for (const auto order : {SurfelOrder::coherent, SurfelOrder::shuffled}) {
    const DollCloud doll = dollCloud(kDollSurfels, order);
    const Splats splats = splatsOf(doll.rest, doll.deformed);
    const Coverage seen = cover(camera, splats);
    fmt::print("{} order: {} surfels, {} drawn, {} visible\n",
               order == SurfelOrder::coherent ? "coherent" : "shuffled", splats.size(), seen.counts.drawn,
               seen.visible.size());
    const slow::Coverage plain = slow::cover(camera, splats);
    const Image plainImage = slow::blend(plain, doll.colors, 3);
    for (const Simd simd : kinds) {
      const Coverage fast = cover(camera, splats, {.simd = simd});
      const double db = decibels(blend(fast, ofVisible(fast, doll.colors), 3), plainImage);
      fmt::print("  {} against plain: {:.1f} dB\n", nameOf(simd), db);
      if (db < 100) return 1;
    }
    const std::vector<float> colors = ofVisible(seen, doll.colors);
    for (const size_t threads : {size_t{1}, size_t{2}}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      std::vector<Times> times(simdNames.size() + 1);
      Kept kept;
      const auto time = [&](Times& to, const auto& coverOnce, const auto& blendOnce) {
        const double wallBegin = wallMilliseconds(), begin = milliseconds();
        const auto& coverage = coverOnce();
        const double middle = milliseconds();
        blendOnce(coverage);
        to.cover.push_back(middle - begin);
        to.blend.push_back(milliseconds() - middle);
        to.wall.push_back(wallMilliseconds() - wallBegin);
      };
      for (int round = 0; round < rounds; ++round) {
        for (const Simd simd : kinds)
          time(
              times[static_cast<size_t>(simd)],
              [&]() -> const Coverage& {
                return kept.coverage = cover(camera, splats, {.simd = simd}, {}, std::move(kept.coverage));
              },
              [&](const Coverage& c) { kept.image = blend(c, colors, 3, std::move(kept.image)); });
        if (round < slowRounds)
          time(
              times.back(), [&] { return slow::cover(camera, splats); },
              [&](const slow::Coverage& c) { return slow::blend(c, doll.colors, 3); });
      }
      fmt::print(" {} thread{}\n", threads, threads == 1 ? "" : "s");
      for (const Simd simd : kinds)
        times[static_cast<size_t>(simd)].print(nameOf(simd).data(), splats.size());
      if (slowRounds > 0) times.back().print("plain", splats.size());
    }
  }
  return 0;
}

} // namespace
} // namespace surflect

int main(int argc, char** argv) {
  int rounds = 9, slowRounds = 1;
  std::string_view only;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string_view(argv[i]) == "--simd") only = argv[i + 1];
    if (std::string_view(argv[i]) == "--rounds") rounds = std::atoi(argv[i + 1]);
    if (std::string_view(argv[i]) == "--slow-rounds") slowRounds = std::atoi(argv[i + 1]);
  }
  return surflect::run(std::max(rounds, 1), slowRounds, only);
}
