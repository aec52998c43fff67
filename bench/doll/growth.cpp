#include "bench/doll/growth.h"

#include "bench/doll/doll_model.h"
#include "bench/doll/fewer_views.h"
#include "bench/doll/studio.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <deque>
#include <initializer_list>
#include <numbers>
#include <numeric>

namespace surflect::bench {

namespace {

constexpr size_t kCacheBytes = size_t{4} << 30; // more than a frame needs
constexpr size_t kLights = 5;                   // where something else grows

// A few frames that are timed by turns.
class Turns {
public:
  // The model must outlive this.
  void add(std::string name, const model::Model& model, Shot shot, int frames) {
    turns_.emplace_back(std::move(name), model, std::move(shot), frames);
  }
  // Adds a row for each to `rows`; the number of the first of them.
  size_t time(int frames, const Progress& progress, std::vector<GrowthRow>& rows) {
    for (int i = 0; i < frames; ++i)
      for (Rotation& turn : turns_) {
        progress.checkpoint();
        turn.timer.lap();
      }
    const size_t first = rows.size();
    for (const Rotation& turn : turns_) rows.push_back({turn.name, turn.timer.times()});
    return first;
  }
  const FrameTimer& operator[](size_t i) const { return turns_[i].timer; }

private:
  struct Rotation {
    Rotation(std::string name_, const model::Model& model, Shot shot_, int frames)
        : name(std::move(name_)), shot(std::move(shot_)), cache(model.files, kCacheBytes),
          timer(model, shot, cache, frames) {}
    std::string name;
    Shot shot;
    codec::BlockCache cache;
    FrameTimer timer;
  };
  std::deque<Rotation> turns_; // which stay where they are
};

// A sweep over rows of which `turns` are those from `base` on; steps that are none are left out.
void addSweep(Growth& growth, const char* what, size_t FrameCounts::*size, const Turns& turns, size_t base,
              std::initializer_list<size_t> order) {
  GrowthSweep sweep{what, {}};
  for (const size_t* to = order.begin() + 1; to != order.end(); ++to) {
    const size_t from = to[-1];
    const auto sizeOf = [&](size_t turn) { return growth.rows[base + turn].times.counts.*size; };
    if (sizeOf(*to) > sizeOf(from))
      sweep.steps.push_back({base + from, base + *to, sizeOf(from), sizeOf(*to),
                             timeRatio(turns[*to].frames(), turns[from].frames())});
  }
  if (!sweep.steps.empty()) growth.sweeps.push_back(std::move(sweep));
}

std::string viewsOf(const model::Model& model) { return fmt::format("{} views", model.rig.views.size()); }

// All but the surfels.
void measureShots(const model::Model& model, const model::Model& half, const model::Model& quarter, int width,
                  int height, int frames, const Progress& progress, Growth& growth) {
  const auto shot = [&](const model::Model& of, int scale, size_t lights) {
    return dollShot(of, scale * width, scale * height, lights);
  };
  Shot inStudio = shot(model, 1, 1);
  const model::ShadeOptions& options = inStudio.options.shade;
  const scene::PreparedEnvironment studio =
      scene::prepareEnvironment(studioLight(), 0.01, ulr::LightExtrapolation::fade, model, options, progress);
  const Mat3<double> upright = // y of the studio to z
      Eigen::AngleAxisd(std::numbers::pi / 2, Vec3<double>::UnitX()).toRotationMatrix();
  inStudio.lights = {scene::ShotEnvironment{&studio, Rotation<ObjectSpace, EnvironmentSpace>(upright)}};

  Turns turns;
  enum : size_t { kQuarter, kHalf, kAll, kLarge, kOneLight, kManyLights, kStudio };
  turns.add(viewsOf(quarter), quarter, shot(quarter, 1, kLights), frames);
  turns.add(viewsOf(half), half, shot(half, 1, kLights), frames);
  turns.add(viewsOf(model), model, shot(model, 1, kLights), frames);
  turns.add(fmt::format("{}x{}", 2 * width, 2 * height), model, shot(model, 2, kLights), frames);
  turns.add("1 light", model, shot(model, 1, 1), frames);
  turns.add("60 lights", model, shot(model, 1, 60), frames);
  turns.add(fmt::format("environment, {} directions", studio.lights.size()), model, std::move(inStudio),
            frames);
  const size_t base = turns.time(frames, progress, growth.rows);
  addSweep(growth, "views", &FrameCounts::views, turns, base, {kQuarter, kHalf, kAll});
  addSweep(growth, "pixels", &FrameCounts::pixels, turns, base, {kAll, kLarge});
  addSweep(growth, "lights", &FrameCounts::lights, turns, base, {kOneLight, kAll, kManyLights});
  growth.sixtyLights = timeRatio(turns[kManyLights].lookUps(), turns[kAll].lookUps());
  growth.environment = timeRatio(turns[kStudio].lookUps(), turns[kAll].lookUps());
}

model::Model withSurface(const model::Model& model, DollSurface surface) {
  std::vector<size_t> all(model.rig.views.size());
  std::iota(all.begin(), all.end(), size_t{0});
  model::Model other = withViews(model, all);
  other.cloud = std::move(surface.cloud);
  other.middle = middleOf(other.cloud.p0);
  other.fades = std::move(surface.fades);
  return other;
}

void measureSurfels(const model::Model& model, int width, int height, int frames, const Progress& progress,
                    Growth& growth) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const capture::View& view : model.rig.views) cameras.push_back(view.camera);
  const Progress quiet{.report = {}, .cancelled = progress.cancelled};
  const auto denser = [&](size_t times) {
    return withSurface(model, dollSurface(times * model.cloud.size(), DollSize().seed, cameras, quiet));
  };
  model::Model twice, fourTimes;
  tbb::parallel_invoke([&] { fourTimes = denser(4); }, [&] { twice = denser(2); }); // sampling has one thread
  Turns turns;
  for (const model::Model* each : std::initializer_list<const model::Model*>{&model, &twice, &fourTimes})
    turns.add(fmt::format("{}, {} surfels", viewsOf(*each), each->cloud.size()), *each,
              dollShot(*each, width, height, kLights), frames);
  const size_t base = turns.time(frames, progress, growth.rows);
  addSweep(growth, "surfels", &FrameCounts::surfels, turns, base, {0, 1, 2});
}

} // namespace

double GrowthSweep::exponent() const {
  assert(!steps.empty());
  double time = 1, size = 1;
  for (const GrowthStep& step : steps) {
    time *= step.frame.median;
    size *= step.size();
  }
  return std::log(time) / std::log(size);
}

TimeRatio GrowthSweep::worst() const {
  assert(!steps.empty());
  const auto overSize = [](const GrowthStep& step) {
    return TimeRatio{step.frame.median / step.size(), step.frame.error / step.size()};
  };
  return overSize(
      *std::ranges::max_element(steps, {}, [&](const GrowthStep& step) { return overSize(step).median; }));
}

Growth measureGrowth(const model::Model& model, int width, int height, int frames, const Progress& progress) {
  const size_t views = model.rig.views.size();
  const auto part = [&](size_t of) {
    return withViews(model, evenViews(model, std::max(size_t{1}, views / of)));
  };
  Growth growth;
  const model::Model half = part(2), quarter = part(4);
  progress("growth with views, lights and pixels", 0);
  measureShots(model, half, quarter, width, height, frames, progress, growth);
  if (isDoll(model.rig)) {
    progress("growth with surfels", 0);
    measureSurfels(quarter, width, height, frames, progress, growth);
  }
  return growth;
}

} // namespace surflect::bench
