// Checks the controller of --tolerance on films, and prints the tables of docs/results/control.md: what each
// knob does alone, how often the true error of a frame is within the tolerance, and how the time of the
// chosen setting compares with the fastest setting that is within it, found by a sweep over many settings in
// some frames.
#include "render/control/controller.h"
#include "render/control/knob_effects.h"
#include "render/film/shot_renderer.h"
#include "render/methods.h"
#include "surfel/base/error.h"
#include "surfel/base/time.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace surflect::bench {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNearly = 1.2;     // times the tolerance, within which 95 % of the frames should be
constexpr size_t kCandidates = 3;   // fastest swept settings that are timed again
constexpr int kRepeats = 5;         // of such a timing; the shortest counts
constexpr int kRepeatsOfKnob = 2;   // of a knob alone
constexpr double kSavingStep = 1.3; // by which the least saving of a swept value grows

struct Arguments {
  std::vector<std::string> scripts{"examples/vase.toml", "examples/cat.toml", "bench/control/zoom.toml"};
  std::vector<double> tolerances{0.01, 0.02, 0.05};
  int frames = 100, sweeps = 2;
  size_t settings = 150;
  double scale = 0.5;
};

// A setting, rendered in one frame.
struct Trial {
  method::Setting setting;
  double error = 0, seconds = 0, work = 0; // processor seconds
};

// A value of a knob, alone.
struct KnobRow {
  double error = 0, time = 0, work = 0; // relative to full
};
using KnobTable = std::map<std::pair<size_t, std::string>, std::map<std::string, KnobRow>>; // by film

double workOf(const method::FrameReport& report) {
  double work = 0;
  for (const auto& [name, count] : report.counts)
    if (name.starts_with("work.")) work += count;
  return work;
}

double correlationOf(const std::vector<Trial>& trials) {
  const auto n = static_cast<double>(trials.size());
  double work = 0, seconds = 0, workSquares = 0, secondsSquares = 0, products = 0;
  for (const Trial& trial : trials) {
    work += trial.work / n;
    seconds += trial.seconds / n;
  }
  for (const Trial& trial : trials) {
    workSquares += (trial.work - work) * (trial.work - work);
    secondsSquares += (trial.seconds - seconds) * (trial.seconds - seconds);
    products += (trial.work - work) * (trial.seconds - seconds);
  }
  return products / std::sqrt(workSquares * secondsSquares);
}

std::vector<method::Option> knobsOf(const method::Renderer& renderer) {
  std::vector<method::Option> knobs(renderer.options().begin(), renderer.options().end());
  std::erase_if(knobs, [](const method::Option& option) { return option.sweep.empty(); });
  return knobs;
}

size_t combinationsOf(const std::vector<method::Option>& knobs) {
  size_t product = 1;
  for (const method::Option& knob : knobs) product *= knob.sweep.size();
  return product;
}

// Moves on to the next combination of the knobs' steps, in lexicographic order. Returns false after the last.
bool moveOn(const std::vector<method::Option>& knobs, control::Steps& steps) {
  for (size_t k = knobs.size(); k-- > 0; steps[k] = 0)
    if (++steps[k] < knobs[k].sweep.size()) return true;
  return false;
}

// Result of one tolerance on a film.
struct Tally {
  double tolerance = 0;
  size_t within = 0, nearly = 0;
  double largest = 0;                  // error
  double time = 0, best = 0, full = 0; // processor seconds, over swept frames
  std::set<method::Setting> settings;
};

class Film {
public:
  Film(const std::string& path, const Arguments& arguments, KnobTable& table)
      : arguments_(arguments), renderer_(method::openRenderer(scene::readScriptHead(path).model)),
        script_(readScript(path, arguments.frames)), shot_(script_, *renderer_, progress_), table_(table) {}

  void check() {
    const int first = script_.frames->first, last = script_.frames->last;
    std::set<int> swept;
    for (int i = 0; i < arguments_.sweeps; ++i)
      swept.insert(first + (2 * i + 1) * (last - first) / (2 * arguments_.sweeps));
    std::vector<Tally> tallies;
    std::vector<control::Controller> controllers;
    for (const double tolerance : arguments_.tolerances) {
      tallies.emplace_back().tolerance = tolerance;
      controllers.emplace_back(
          *renderer_, [this](int frame) { return shot_.render(frame, arguments_.scale, {}); },
          control::FrameRange{first, last}, control::Target{control::Target::Kind::tolerance, tolerance});
    }
    for (int frame = first; frame <= last; ++frame) {
      const image::Image full = render(frame, {}).color;
      const std::vector<Trial> trials = swept.contains(frame) ? sweep(frame, full) : std::vector<Trial>();
      for (size_t i = 0; i < tallies.size(); ++i)
        add(frame, full, controllers[i].choose(frame).setting, trials, tallies[i]);
    }
    for (size_t i = 0; i < tallies.size(); ++i) print(tallies[i], controllers[i].probes());
  }

private:
  static scene::Script readScript(const std::string& path, int frames) {
    scene::Script script = scene::readScript(path);
    script.frames->last = script.frames->first + frames - 1;
    return script;
  }

  std::string name() const { return script_.path.stem().string(); }

  method::FrameLayers render(int frame, const method::Setting& setting) {
    renderer_->set(setting);
    return shot_.render(frame, arguments_.scale, {});
  }

  // Processor seconds, as the machine may have other work.
  Trial trial(int frame, const method::Setting& setting, const image::Image& full) {
    const double start = processorSeconds();
    const method::FrameLayers layers = render(frame, setting);
    const double seconds = processorSeconds() - start;
    return {setting, control::relativeRms(layers.color, full), seconds, workOf(layers.report)};
  }

  // Fills the film's column of the table of knobs.
  void turnOneByOne(int frame, const image::Image& full) {
    const std::vector<method::Option> knobs = knobsOf(*renderer_);
    for (size_t k = 0; k < knobs.size(); ++k)
      for (size_t i = 1; i < knobs[k].sweep.size(); ++i) {
        const method::Setting setting{{knobs[k].name, knobs[k].sweep[i]}};
        render(frame, setting); // builds what the setting needs once
        double seconds = kInfinite, fullSeconds = kInfinite, fullWork = 0;
        Trial found;
        for (int repeat = 0; repeat < kRepeatsOfKnob; ++repeat) {
          const Trial atFull = trial(frame, {}, full);
          found = trial(frame, setting, full);
          fullSeconds = std::min(fullSeconds, atFull.seconds);
          seconds = std::min(seconds, found.seconds);
          fullWork = atFull.work;
        }
        table_[{k, method::textOf(setting)}][name()] = {found.error, seconds / fullSeconds,
                                                        found.work / fullWork};
      }
  }

  // Values worth sweeping: alone within the largest tolerance, and each saving so much of the work of the
  // value before that at most arguments.settings combinations remain.
  std::vector<method::Option> worthSweeping() const {
    const double most = std::ranges::max(arguments_.tolerances);
    for (double saving = 0.01;; saving *= kSavingStep) {
      std::vector<method::Option> kept = knobsOf(*renderer_);
      for (size_t k = 0; k < kept.size(); ++k) {
        double work = 1; // of the last value that is kept
        std::erase_if(kept[k].sweep, [&, full = kept[k].sweep.front()](const method::Value& value) {
          if (value == full) return false;
          const KnobRow& row = table_.at({k, method::textOf({{kept[k].name, value}})}).at(name());
          const bool isWorth = row.error <= most && row.work <= (1 - saving) * work;
          if (isWorth) work = row.work;
          return !isWorth;
        });
      }
      if (combinationsOf(kept) <= arguments_.settings) return kept;
    }
  }

  // Renders a frame with the combinations of values that are worth sweeping. Leaves out settings that are at
  // least as fast, by every knob, as one that is beyond the largest tolerance.
  std::vector<Trial> sweep(int frame, const image::Image& full) {
    if (values_.empty()) {
      turnOneByOne(frame, full);
      values_ = worthSweeping();
    }
    std::vector<Trial> trials;
    std::vector<control::Steps> failed;
    control::Steps steps(values_.size(), 0);
    do {
      if (std::ranges::any_of(failed, [&](const auto& f) { return control::isAtLeastAsFast(steps, f); }))
        continue;
      method::Setting setting;
      for (size_t k = 0; k < steps.size(); ++k)
        if (steps[k] > 0) setting[values_[k].name] = values_[k].sweep[steps[k]];
      trials.push_back(trial(frame, setting, full));
      if (trials.back().error > std::ranges::max(arguments_.tolerances)) failed.push_back(steps);
    } while (moveOn(values_, steps));
    std::string swept;
    for (const method::Option& knob : values_)
      if (knob.sweep.size() > 1) {
        swept += "; " + knob.name;
        for (const method::Value& value : knob.sweep) swept += " " + value.text();
      }
    fmt::print(stderr, "{}: frame {}: {} settings, correlation of work and processor time {:.3f}{}\n", name(),
               frame, trials.size(), correlationOf(trials), swept);
    return trials;
  }

  // Adds a frame to a tally, and, if it was swept, the times of the chosen and of the fastest setting.
  void add(int frame, const image::Image& full, const method::Setting& chosen, std::vector<Trial> trials,
           Tally& tally) {
    const double error = trial(frame, chosen, full).error;
    tally.within += error <= tally.tolerance;
    tally.nearly += error <= kNearly * tally.tolerance;
    tally.largest = std::max(tally.largest, error);
    tally.settings.insert(chosen);
    if (trials.empty()) return;
    std::erase_if(trials, [&](const Trial& t) { return t.error > tally.tolerance; });
    std::ranges::sort(trials, {}, &Trial::seconds);
    trials.resize(std::min(trials.size(), kCandidates));
    std::vector<method::Setting> raced{{}, chosen};
    for (const Trial& candidate : trials) raced.push_back(candidate.setting);
    std::vector<double> seconds(raced.size(), kInfinite);
    for (int repeat = 0; repeat < kRepeats; ++repeat)
      for (size_t i = 0; i < raced.size(); ++i)
        seconds[i] = std::min(seconds[i], trial(frame, raced[i], full).seconds);
    tally.full += seconds[0];
    tally.time += seconds[1];
    tally.best += std::ranges::min(seconds);
  }

  void print(const Tally& tally, size_t probes) const {
    fmt::print("| {} | {:g} | {} | {} | {:.4f} | {} | {} | {:.2f} | {:.2f} |\n", name(), tally.tolerance,
               tally.within, tally.nearly, tally.largest, tally.settings.size(), probes,
               tally.time / tally.best, tally.full / tally.time);
    std::fflush(stdout);
  }

  const Arguments& arguments_;
  const Progress progress_;
  const std::unique_ptr<method::Renderer> renderer_;
  const scene::Script script_;
  film::ShotRenderer shot_;
  KnobTable& table_;
  std::vector<method::Option> values_; // that are swept
};

void print(const KnobTable& table, const std::vector<std::string>& films) {
  fmt::print("\n| knob alone |");
  for (const std::string& film : films) fmt::print(" {}: error | time | work |", film);
  fmt::print("\n|---|");
  for (size_t i = 0; i < films.size(); ++i) fmt::print("---:|---:|---:|");
  for (const auto& [key, rows] : table) {
    fmt::print("\n| `{}` |", key.second);
    for (const std::string& film : films) {
      const auto row = rows.find(film);
      if (row == rows.end())
        fmt::print(" | | |");
      else
        fmt::print(" {:.4f} | {:.2f} | {:.2f} |", row->second.error, row->second.time, row->second.work);
    }
  }
  fmt::print("\n");
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect::bench;
  Arguments arguments;
  CLI::App app(
      "Checks the controller of --tolerance on films, and prints the tables of docs/results/control.md.",
      "bench_control");
  app.add_option("scripts", arguments.scripts, "scripts in model coordinates")->capture_default_str();
  app.add_option("--tolerances", arguments.tolerances)
      ->delimiter(',')
      ->check(CLI::Range(1e-9, 1.0))
      ->capture_default_str();
  app.add_option("--frames", arguments.frames, "over which a film is stretched")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--sweeps", arguments.sweeps, "frames of each film that are rendered with many settings")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--settings", arguments.settings, "most settings of such a frame")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--scale", arguments.scale, "factor on width and height")
      ->check(CLI::Range(0.01, 8.0))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    fmt::print("| film | tolerance | frames within it | within 1.2 times | largest error | settings | "
               "frames rendered to choose | time over best | full over time |\n"
               "|---|---:|---:|---:|---:|---:|---:|---:|---:|\n");
    KnobTable table;
    std::vector<std::string> films;
    for (const std::string& script : arguments.scripts) {
      films.push_back(std::filesystem::path(script).stem().string());
      Film(script, arguments, table).check();
    }
    print(table, films);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_control: {}\n", error.what());
    return 1;
  }
}
