#include "render/lightfield/spherical/flight.h"

#include "tests/render/lightfield/spherical/slow_disk.h"
#include "tests/render/lightfield/spherical/synthetic_field.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::spherical {
namespace {

constexpr double kGpu = 2e-4, kMain = 4e-4, kDisk = 3e-3;

double setupAt(double detail) { return 4e-3 + 1e-3 * std::ceil(detail); }

// A machine with known times, up to 3 % of noise.
struct Machine {
  VirtualClock clock;
  std::mt19937 random{13};
  double detail = 0;

  Canvas canvas() {
    return {[this](const Look& look) { detail = look.detail; },
            [this](std::span<const TexturedTriangle> triangles) {
              clock.seconds += noisy(kGpu * static_cast<double>(triangles.size()));
            },
            [this] { clock.seconds += noisy(setupAt(detail)); }, [this] { return clock.seconds; }};
  }
  double noisy(double seconds) { return seconds * std::uniform_real_distribution(0.97, 1.03)(random); }
};

const FrameTimes kStart{1e-4, 1e-3, 1e-2, 1e-3}; // wrong by factors of 2 to 5

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

// [Domingo 2007, Fig. 5]: a circle in steps of 5 degrees; frames wait for their images.
TEST(Flight, PredictsTheTimeOfAnOrbit) {
  const DirectionTree tree(5);
  Machine machine;
  SlowDisk disk(machine.clock, kDisk);
  CountingTextures textures(machine.clock, kMain);
  ImageCache cache({400, 300}, disk, textures);
  FrameTimeModel model(5, kStart);
  Flight flight(tree, cache, model, {.wait = true});
  std::vector<double> errors;
  size_t reads = 0;
  constexpr int kSteps = 72, kWarmUp = 8;
  for (int step = 0; step < kWarmUp + kSteps; ++step) {
    const double angle = 2 * std::numbers::pi * step / kSteps;
    const Window window = windowOf(cameraAt({4 * std::cos(angle), 1, 4 * std::sin(angle)}, 64), {});
    const FrameRecord record = flight.frame(window, {4, 0, false, false}, machine.canvas());
    if (step < kWarmUp) continue;
    errors.push_back(std::abs(record.predicted - record.seconds) / record.seconds);
    reads += record.counts.reads;
  }
  EXPECT_LT(median(errors), 0.1);
  EXPECT_GT(reads, 500u); // the disk is part of it
}

TEST(Flight, KeepsItsBudgetAtTheHighestLevelThatFits) {
  const DirectionTree tree(6);
  for (const double budget : {0.033, 0.1, 0.3}) {
    Machine machine;
    SlowDisk disk(machine.clock, kDisk / 10);
    CountingTextures textures(machine.clock, kMain);
    ImageCache cache({4000, 1500}, disk, textures);
    FrameTimeModel model(6, kStart);
    Flight flight(tree, cache, model, {.budget = budget});
    constexpr int kFrames = 600, kWarmUp = 60;
    double chosen = 0, best = 0, ancestors = 0;
    int within = 0;
    for (int i = 0; i < kFrames; ++i) {
      // Around the object, nearer and farther, up and down.
      const double a = 0.03 * i, distance = 4 + std::sin(0.011 * i);
      const Vec3<double> from =
          distance * Vec3<double>(std::cos(a), 0.8 * std::sin(0.017 * i), std::sin(a)).normalized();
      const Window window = windowOf(cameraAt(from, 64), {});
      const FrameRecord record = flight.frame(window, {0, 0, false, false}, machine.canvas());
      if (i < kWarmUp) continue;
      within += record.seconds <= 1.1 * budget;
      chosen += record.detail.level / (kFrames - kWarmUp);
      ancestors += static_cast<double>(record.counts.substituted) /
                   static_cast<double>(record.counts.triangles) / (kFrames - kWarmUp);
      double fitting = 0; // highest level whose time, images at hand, is within the budget
      for (int level = 1; level < 6; ++level)
        if (kGpu * static_cast<double>(visiblePencils(tree, static_cast<size_t>(level), window).size()) +
                setupAt(level) <=
            budget)
          fitting = level;
      best += fitting / (kFrames - kWarmUp);
    }
    EXPECT_GE(within, 0.95 * (kFrames - kWarmUp)) << budget;
    EXPECT_NEAR(chosen, best, 1.0 / 3) << budget;
    EXPECT_GT(best, 2);
    EXPECT_LT(ancestors, 0.1) << budget; // the level is not only a name
  }
}

TEST(FrameTimeModel, FindsTheTimesOfFrames) {
  FrameTimeModel model(4, kStart);
  std::mt19937 random(14);
  for (int i = 0; i < 200; ++i) {
    const FrameCounts counts{.triangles = random() % 500, .uploads = random() % 40, .reads = random() % 20};
    const double detail = static_cast<double>(random() % 4);
    model.add(counts, {detail, 0},
              kGpu * static_cast<double>(counts.triangles) + kMain * static_cast<double>(counts.uploads) +
                  kDisk * static_cast<double>(counts.reads) + setupAt(detail));
  }
  for (const double detail : {0., 1., 2., 3.}) {
    const FrameTimes times = model.times({detail, 0});
    EXPECT_NEAR(times.gpu, kGpu, 0.02 * kGpu);
    EXPECT_NEAR(times.main, kMain, 0.02 * kMain);
    EXPECT_NEAR(times.disk, kDisk, 0.02 * kDisk);
    EXPECT_NEAR(times.setup, setupAt(detail), 0.05 * setupAt(detail));
  }
}

TEST(FrameTimeModel, KeepsItsStartWhereNoFrameTells) {
  FrameTimeModel model(4, kStart);
  EXPECT_NEAR(model.predict({.triangles = 10, .uploads = 2, .reads = 1}, {2, 0}), 1e-3 + 2e-3 + 1e-2 + 1e-3,
              1e-9);
  for (int i = 0; i < 50; ++i) {
    model.add({.triangles = 100}, {1, 0}, 0.05);
    model.add({.triangles = 200}, {1, 0}, 0.06);
  }
  const FrameTimes times = model.times({3, 0});
  EXPECT_NEAR(times.disk, kStart.disk, 1e-6); // no frame has read anything
  EXPECT_NEAR(times.setup, 0.04, 2e-3);       // that of level 1 is the best guess
  EXPECT_NEAR(model.predict({.triangles = 100}, {1, 0}), 0.05, 1e-3);
}

TEST(FrameTimeModel, TimesAreNeverNegative) {
  FrameTimeModel model(2, kStart);
  for (int i = 0; i < 100; ++i) {
    model.add({.triangles = 100}, {0, 0}, 0.05);
    model.add({.triangles = 100, .uploads = 10}, {0, 0}, 0.04); // faster with more work
  }
  const FrameTimes times = model.times({0, 0});
  for (const double time : {times.gpu, times.main, times.disk, times.setup}) EXPECT_GE(time, 0);
}

TEST(DetailControl, ClimbsByThirdsAndFallsAtOnce) {
  DetailControl control(5, {.budget = 0.1, .headroom = 0.9, .patience = 2});
  double cost = 0.01; // of a level
  const auto choose = [&] {
    return control.choose([&](const Detail& detail) { return cost * detail.level; }).level;
  };
  for (int thirds = 1; thirds <= 12; ++thirds) EXPECT_NEAR(choose(), thirds / 3.0, 1e-12);
  EXPECT_EQ(choose(), 4); // the finest
  cost = 0.045;
  EXPECT_EQ(choose(), 2);
  cost = 0.01;
  EXPECT_EQ(choose(), 2); // patience
  EXPECT_EQ(choose(), 2);
  EXPECT_NEAR(choose(), 2 + 1 / 3.0, 1e-12);
}

TEST(DetailControl, ASteadyLoadNearTheLimitDoesNotOscillate) {
  DetailControl control(5, {.budget = 0.1});
  std::mt19937 random(15);
  double before = 0;
  int changes = 0;
  for (int i = 0; i < 200; ++i) {
    const double noise = std::uniform_real_distribution(0.97, 1.03)(random);
    const double now =
        control.choose([&](const Detail& detail) { return noise * 0.049 * detail.level; }).level;
    if (i > 20) changes += now != before;
    before = now;
  }
  EXPECT_EQ(changes, 0);
}

// Coarse levels may cost more, and that is known only of levels that were drawn.
TEST(DetailControl, CoarseLevelsThatCostMoreThanFineOnesAreLeft) {
  for (const double budget : {0.25, 0.1}) { // one that level 2 and 3 keep, and one that none keeps
    DetailControl control(4, {.budget = budget});
    const std::vector<double> costs{0.36, 0.34, 0.13, 0.12};
    std::vector<double> known(4, 0.3);
    Detail detail;
    for (int frame = 0; frame < 40; ++frame) {
      detail = control.choose([&](const Detail& asked) {
        const auto coarse = static_cast<size_t>(asked.level);
        return asked.level == std::floor(asked.level) ? known[coarse] : known[coarse] + known[coarse + 1];
      });
      const auto coarse = static_cast<size_t>(detail.level);
      known[coarse] = costs[coarse];
    }
    EXPECT_EQ(detail, (Detail{3, 0})) << budget; // coarser mip levels take as long
  }
}

// A machine whose time depends on the size of texels.
TEST(DetailControl, PositionalDetailIsGivenUpWhereNoLevelFitsAndTakenAgain) {
  DetailControl control(3, {.budget = 0.1});
  const std::vector<double> costs{0.11, 0.16, 0.2}, savings{1, 0.6, 0.4};
  std::map<Detail, double> known;
  double scale = 1.2;
  const auto after = [&](int frames) {
    Detail detail;
    for (int frame = 0; frame < frames; ++frame) {
      detail = control.choose([&](const Detail& asked) {
        const auto found = known.find(asked);
        return found != known.end() ? found->second : known.empty() ? 0.15 : known.begin()->second;
      });
      for (size_t coarse = 0; coarse < costs.size(); ++coarse) // as the model, which knows the object's size
        for (int coarser = 0; coarser <= kMostCoarser; ++coarser)
          if (const Detail of{static_cast<double>(coarse), coarser}; of == detail || known.contains(of))
            known[of] = scale * costs[coarse] * savings[static_cast<size_t>(coarser)];
    }
    return detail;
  };
  EXPECT_EQ(after(40), (Detail{0, 1}));
  scale = 0.45;
  EXPECT_EQ(after(40), (Detail{2, 0}));
  scale = 4;
  EXPECT_EQ(after(40), (Detail{0, 2})); // nothing fits: the cheapest
}

TEST(DetailControl, ABlendThatCostsTooMuchIsSkipped) {
  DetailControl control(3, {.budget = 0.1});
  const auto predicted = [](const Detail& detail) {
    const bool isBlend = detail.level != std::floor(detail.level);
    return detail.level > 1 && isBlend ? 0.11 : 0.08;
  };
  for (int i = 0; i < 3; ++i) control.choose(predicted);
  EXPECT_EQ(control.choose(predicted), (Detail{2, 0}));
}

} // namespace
} // namespace surflect::spherical
