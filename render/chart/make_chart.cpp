#include "render/chart/make_chart.h"

#include "render/chart/front.h"
#include "render/chart/measurements.h"
#include "render/chart/samples.h"
#include "render/chart/subject.h"
#include "surfel/base/folder.h"
#include "surfel/base/message_text.h"
#include "surfel/base/stopwatch.h"
#include "surfel/math/median.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace surflect::chart {

namespace {

namespace fs = std::filesystem;
using method::Option, method::Setting, method::Value;

// Times of a setting, frame by frame.
struct Times {
  Subject* subject;
  Setting setting;
  std::vector<std::vector<double>> milliseconds;                  // by frame and round
  std::vector<std::map<std::string, std::vector<double>>> stages; // milliseconds
};

Timing timingOf(const Times& times) {
  Timing timing;
  const auto frames = static_cast<double>(times.milliseconds.size());
  for (size_t frame = 0; frame < times.milliseconds.size(); ++frame) {
    timing.milliseconds += median(times.milliseconds[frame]) / frames;
    for (const auto& [stage, values] : times.stages[frame]) timing.stages[stage] += median(values) / frames;
  }
  return timing;
}

// Times all settings whose time is not known, in turn and round by round, there and back: whatever slows the
// machine for a while meets all of them alike. The first round fills the caches and does not count, nor does
// the first frame of each turn, which follows one of another setting, with buffers of other sizes.
void measureTimes(std::vector<std::unique_ptr<Subject>>& subjects, size_t rounds, const Progress& progress) {
  const Progress quiet{{}, progress.cancelled};
  std::vector<Times> all;
  std::map<const Subject*, std::unique_ptr<method::Renderer>> renderers;
  for (const auto& subject : subjects)
    for (const Setting& setting : subject->settings()) {
      if (subject->isTimed(setting)) continue;
      if (!renderers[subject.get()]) renderers[subject.get()] = subject->open(quiet);
      const size_t frames = subject->timedFrames();
      all.push_back({subject.get(), setting, std::vector<std::vector<double>>(frames), {}});
      all.back().stages.resize(frames);
    }
  method::FrameLayers layers;
  for (size_t round = 0; round <= rounds; ++round)
    for (size_t k = 0; k < all.size(); ++k) {
      progress("time",
               static_cast<double>(round * all.size() + k) / static_cast<double>((rounds + 1) * all.size()));
      Times& times = all[round % 2 ? all.size() - 1 - k : k];
      method::Renderer& renderer = *renderers.at(times.subject);
      times.subject->set(renderer, times.setting);
      const auto secondsOf = [&](size_t frame) {
        const scene::Scene scene = scaled(times.subject->timed(frame).scene, scaleOf(times.setting));
        const Stopwatch watch;
        layers = renderer.render(scene, {}, quiet, std::move(layers));
        return watch.seconds();
      };
      secondsOf(0);
      for (size_t frame = 0; frame < times.milliseconds.size(); ++frame) {
        const double seconds = secondsOf(frame);
        if (round == 0) continue;
        times.milliseconds[frame].push_back(1e3 * seconds);
        for (const auto& [stage, stageSeconds] : layers.report.seconds)
          times.stages[frame][stage].push_back(1e3 * stageSeconds);
      }
    }
  for (const Times& times : all) times.subject->keepTiming(times.setting, timingOf(times));
}

void addPanels(Chart& chart, const std::vector<std::unique_ptr<Subject>>& subjects,
               const Progress& progress) {
  for (const auto& subject : subjects) {
    std::unique_ptr<method::Renderer> renderer;
    for (size_t i = 0; i < chart.points.size(); ++i) {
      const Point& point = chart.points[i];
      if (!point.isChosen || point.model != subject->model()) continue;
      if (!renderer) renderer = subject->open(progress);
      for (Panel& panel : subject->panels(point.setting, *renderer, progress)) {
        panel.point = i;
        chart.panels.push_back(std::move(panel));
      }
    }
  }
}

// Adds the values that are swept; models may have different knobs.
void addKnobs(std::vector<Option>& all, const std::vector<Option>& knobs) {
  for (const Option& knob : knobs) {
    const auto found = std::ranges::find(all, knob.name, &Option::name);
    if (found == all.end()) {
      all.push_back(knob);
      continue;
    }
    for (const Value& value : knob.sweep)
      if (std::ranges::find(found->sweep, value) == found->sweep.end()) found->sweep.push_back(value);
  }
}

} // namespace

Chart makeChart(const std::vector<fs::path>& models, const capture::Capture& capture,
                const std::optional<BentTruth>& bent, const fs::path& folder, const ChartOptions& options,
                const Progress& progress) {
  Measurements measurements(folder / "measurements.jsonl");
  std::vector<std::unique_ptr<Subject>> subjects;
  size_t points = 0, steps = 0;
  for (const fs::path& model : models) {
    subjects.push_back(std::make_unique<Subject>(model, capture, bent, options, measurements, progress));
    points += subjects.back()->settings().size();
    steps += subjects.back()->longestDescent();
  }
  for (const method::Sweep& sweep : options.sweep)
    if (std::ranges::none_of(subjects, [&](const auto& subject) {
          return std::ranges::count(subject->options(), sweep.name, &Option::name) > 0;
        }))
      method::rowOf({folderName(models.front()), subjects.front()->options()}, sweep.name); // throws

  Chart chart;
  const Subject& first = *subjects.front();
  chart.machine = options.machine;
  chart.command = options.command;
  chart.restFrames = first.rest().all().size();
  chart.restHeldOut = first.rest().heldOut();
  if (first.bent()) {
    chart.bentFrames = first.bent()->all().size();
    chart.bentHeldOut = first.bent()->heldOut();
  }
  options.announce(fmt::format(
      "{} of {}{}, {} of {} held-out frames{}", counted(points, "setting"), counted(models.size(), "model"),
      steps > 0 ? fmt::format(" and at most {} of a greedy descent", steps) : "", chart.restFrames,
      chart.restHeldOut,
      chart.bentFrames > 0 ? fmt::format(", {} of {} deformed", chart.bentFrames, chart.bentHeldOut) : ""));

  const Progress quiet{{}, progress.cancelled}; // renderers would report their own stages
  for (const auto& subject : subjects) subject->descend(progress);
  size_t settings = 0, measured = 0;
  for (const auto& subject : subjects) settings += subject->settings().size();
  const auto done = [&] {
    progress("accuracy", static_cast<double>(++measured) / static_cast<double>(settings));
  };
  for (const auto& subject : subjects) {
    subject->measureAccuracy(done, quiet);
    if (subject->idleKnobs().empty()) continue;
    chart.idleKnobs[subject->model()] = subject->idleKnobs();
    options.announce(fmt::format("{}: no effect on these frames: {}", folderName(subject->model()),
                                 fmt::join(subject->idleKnobs(), ", ")));
  }
  measureTimes(subjects, options.rounds, progress);

  for (const auto& subject : subjects) {
    addKnobs(chart.knobs, subject->knobs());
    for (const Setting& setting : subject->settings()) chart.points.push_back(subject->pointOf(setting));
    chart.title += (chart.title.empty() ? "" : ", ") + folderName(subject->model());
  }
  chart.title += " on " + folderName(capture.folder());
  markFront(chart.points);
  markChosen(chart.points);
  addPanels(chart, subjects, quiet);
  progress("time", 1);
  return chart;
}

} // namespace surflect::chart
