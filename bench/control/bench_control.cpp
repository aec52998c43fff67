// Checks the controller of --tolerance on films: how often the true error of a frame is within the tolerance,
// and how the time of the chosen setting compares with the fastest setting that is within it, found by
// rendering all combinations of all knobs' values in some frames.
#include "render/control/controller.h"
#include "render/control/relative_error.h"
#include "render/film/shot_renderer.h"
#include "surfel/base/error.h"
#include "surfel/base/processor_time.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace surflect::bench {
namespace {

struct Arguments {
  std::vector<std::string> scripts;
  std::vector<double> tolerances{0.005, 0.01, 0.02, 0.05};
  int frames = 100, sweeps = 5;
  double scale = 1;
};

struct Timed {
  knobs::Setting setting;
  double error = 0, seconds = 0, work = 0;
};

double workOf(const render::FrameReport& report) {
  double work = 0;
  for (const auto& [name, count] : report.counts)
    if (name.starts_with("work.")) work += count;
  return work;
}

std::vector<knobs::Setting> allSettings(const std::vector<knobs::Knob>& knobs) {
  std::vector<knobs::Setting> all{{}};
  for (const knobs::Knob& knob : knobs) {
    std::vector<knobs::Setting> longer;
    for (const knobs::Setting& setting : all)
      for (const double value : knob.values) {
        longer.push_back(setting);
        if (value != knob.values.front()) longer.back()[knob.name] = value;
      }
    all = std::move(longer);
  }
  return all;
}

class Film {
public:
  Film(const std::string& path, const Arguments& arguments)
      : arguments_(arguments), renderer_(render::openRenderer(scene::readScriptHead(path).model)),
        script_(readScript(path, arguments.frames)), shot_(script_, *renderer_, progress_) {}

  void check() {
    const int first = script_.frames->first, last = script_.frames->last;
    for (int i = 0; i < arguments_.sweeps; ++i)
      sweep(first + (2 * i + 1) * (last - first) / (2 * arguments_.sweeps));
    std::map<int, image::Image> full;
    for (int frame = first; frame <= last; ++frame) full[frame] = render(frame, {}).color;
    for (const double tolerance : arguments_.tolerances) check(tolerance, full);
  }

private:
  static scene::Script readScript(const std::string& path, int frames) {
    scene::Script script = scene::readScript(path);
    script.frames->last = script.frames->first + frames - 1;
    return script;
  }

  render::FrameLayers render(int frame, const knobs::Setting& setting) {
    renderer_->turn(setting);
    return shot_.render(frame, arguments_.scale, {});
  }

  // Processor seconds: the machine may have other work.
  double seconds(int frame, const knobs::Setting& setting) {
    const double start = processorSeconds();
    render(frame, setting);
    return processorSeconds() - start;
  }

  // Renders a frame with all settings, each after one at full, so that slow minutes do not favour some.
  void sweep(int frame) {
    const image::Image full = render(frame, {}).color;
    double sumWork = 0, sumTime = 0, squareWork = 0, squareTime = 0, product = 0;
    for (const knobs::Setting& setting : allSettings(renderer_->knobs())) {
      const double start = processorSeconds();
      const render::FrameLayers layers = render(frame, setting);
      const Timed timed{setting, control::relativeRms(layers.color, full), processorSeconds() - start,
                        workOf(layers.report)};
      sweeps_[frame].push_back(timed);
      if (setting.size() == 1)
        fmt::print("  {}: error {:.5f}, {:.3f} of full's work\n", knobs::textOf(setting), timed.error,
                   timed.work / sweeps_[frame].front().work);
      sumWork += timed.work;
      sumTime += timed.seconds;
      squareWork += timed.work * timed.work;
      squareTime += timed.seconds * timed.seconds;
      product += timed.work * timed.seconds;
    }
    const auto n = static_cast<double>(sweeps_[frame].size());
    fmt::print("  frame {}: {} settings, correlation of work and processor time {:.3f}\n", frame, n,
               (n * product - sumWork * sumTime) /
                   std::sqrt((n * squareWork - sumWork * sumWork) * (n * squareTime - sumTime * sumTime)));
  }

  void check(double tolerance, const std::map<int, image::Image>& full) {
    control::Controller controller(
        *renderer_, [&](int frame) { return shot_.render(frame, arguments_.scale, {}); },
        {script_.frames->first, script_.frames->last}, {control::Target::Kind::tolerance, tolerance});
    size_t within = 0, nearly = 0;
    double largest = 0, misprediction = 0, time = 0, best = 0, fullTime = 0, work = 0, bestWork = 0;
    std::set<knobs::Setting> settings;
    for (const auto& [frame, picture] : full) {
      const control::Choice choice = controller.choose(frame);
      settings.insert(choice.setting);
      const double error = control::relativeRms(render(frame, choice.setting).color, picture);
      within += error <= tolerance;
      nearly += error <= 1.2 * tolerance;
      largest = std::max(largest, error);
      misprediction = std::max(misprediction, std::abs(error - choice.predictedError));
      const auto swept = sweeps_.find(frame);
      if (swept == sweeps_.end()) continue;
      // Fastest by one measurement each; then timed again, alternately with the chosen one.
      const Timed *fastest = nullptr, *lightest = nullptr;
      for (const Timed& timed : swept->second) {
        if (timed.error > tolerance) continue;
        if (!fastest || timed.seconds < fastest->seconds) fastest = &timed;
        if (!lightest || timed.work < lightest->work) lightest = &timed;
        if (timed.setting == choice.setting) work += timed.work;
      }
      bestWork += lightest->work;
      std::vector<double> chosenTimes, bestTimes, fullTimes;
      for (int i = 0; i < 5; ++i) {
        chosenTimes.push_back(seconds(frame, choice.setting));
        bestTimes.push_back(seconds(frame, fastest->setting));
        fullTimes.push_back(seconds(frame, {}));
      }
      time += std::ranges::min(chosenTimes);
      best += std::ranges::min(bestTimes);
      fullTime += std::ranges::min(fullTimes);
    }
    fmt::print("| {} | {} | {} of {} | {} | {:.4f} | {:.4f} | {} | {} | {:.2f} | {:.2f} | {:.2f} |\n",
               script_.path.stem().string(), tolerance, within, full.size(), nearly, largest, misprediction,
               settings.size(), controller.probes(), time / best, work / bestWork, fullTime / time);
    std::fflush(stdout);
  }

  const Arguments& arguments_;
  const Progress progress_;
  const std::unique_ptr<render::Renderer> renderer_;
  const scene::Script script_;
  film::ShotRenderer shot_;
  std::map<int, std::vector<Timed>> sweeps_; // by frame
};

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect::bench;
  Arguments arguments;
  CLI::App app("Checks the controller of --tolerance on films.", "bench_control");
  app.add_option("scripts", arguments.scripts, "scripts in model coordinates")->required();
  app.add_option("--tolerances", arguments.tolerances)->delimiter(',')->capture_default_str();
  app.add_option("--frames", arguments.frames, "over which a film is stretched")->capture_default_str();
  app.add_option("--sweeps", arguments.sweeps, "frames that are rendered with all settings")
      ->capture_default_str();
  app.add_option("--scale", arguments.scale)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    fmt::print("| film | tolerance | within | within 1.2 times | largest error | largest misprediction | "
               "settings | probes | time over best | work over best | full over time |\n|---|"
               "---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
    for (const std::string& script : arguments.scripts) Film(script, arguments).check();
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_control: {}\n", error.what());
    return 1;
  }
}
