#include "render/chart/make_chart.h"

#include "render/chart/front.h"
#include "render/chart/measurements.h"
#include "render/chart/samples.h"
#include "render/chart/settings.h"
#include "surfel/base/error.h"
#include "surfel/base/hash.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/message_text.h"
#include "surfel/base/stopwatch.h"
#include "surfel/base/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace surflect::chart {

namespace {

namespace fs = std::filesystem;
using knobs::Knob, knobs::Setting;

double scaleOf(const Setting& setting) {
  const auto found = setting.find(kScale);
  return found == setting.end() ? 1 : found->second;
}

// Turns a renderer's knobs; the scale is the chart's own. Throws Error for a value that cannot be taken.
void turn(render::Renderer& renderer, Setting setting) {
  const double scale = scaleOf(setting);
  if (!(scale > 0 && scale <= 1))
    throw Error::mismatch("above 0, up to 1", numberText(scale)).at(kScale).at("knob");
  setting.erase(kScale);
  renderer.turn(setting);
}

std::vector<Knob> knobsOf(const render::Renderer& renderer) {
  std::vector<Knob> knobs = renderer.knobs();
  knobs.push_back({kScale, "size of the rendered picture, enlarged before it is compared", {1, 0.75, 0.5}});
  return knobs;
}

// The knobs to sweep with the values to try; the most accurate value comes first or, unless `withFull`, only
// where it was asked for.
std::vector<Knob> swept(const std::vector<Knob>& all, const ChartOptions& options, bool withFull) {
  if (options.sweep.empty() && !options.onlyGiven) return all;
  std::vector<Knob> chosen;
  for (const knobs::KnobValues& asked : options.sweep) {
    knobs::requireKnobs(all, {{asked.name, 0}});
    Knob knob = *std::ranges::find(all, asked.name, &Knob::name);
    knob.values.resize(withFull ? 1 : 0);
    for (const double value : asked.values)
      if (std::ranges::find(knob.values, value) == knob.values.end()) knob.values.push_back(value);
    chosen.push_back(std::move(knob));
  }
  return chosen;
}

// A picture of the scene's size, rendered with the scale of a setting to which the renderer has been turned.
render::FrameLayers rendered(render::Renderer& renderer, const scene::Scene& scene, const Setting& setting,
                             const Progress& progress) {
  render::FrameLayers layers = renderer.render(scaled(scene, scaleOf(setting)), {}, progress);
  layers.color = enlarged(std::move(layers.color), scene.camera.lens.width, scene.camera.lens.height);
  return layers;
}

size_t bytesIn(const fs::path& folder) {
  size_t bytes = 0;
  std::error_code failure;
  for (const auto& entry : fs::recursive_directory_iterator(folder, failure))
    if (entry.is_regular_file(failure)) bytes += entry.file_size(failure);
  return bytes;
}

double median(std::vector<double> values) {
  assert(!values.empty());
  std::ranges::sort(values);
  const size_t half = values.size() / 2;
  return values.size() % 2 ? values[half] : (values[half - 1] + values[half]) / 2;
}

// A model of the chart: what is tried, and the frames that its pictures should equal.
class Subject {
public:
  Subject(fs::path model, const capture::Capture& capture, const std::optional<BentTruth>& bent,
          const ChartOptions& options, Measurements& measurements, const Progress& progress)
      : model_(std::move(model)), options_(options), measurements_(measurements) {
    const auto renderer = open(progress);
    rig_ = renderer->describe().rig;
    all_ = knobsOf(*renderer);
    knobs_ = swept(all_, options, true);
    preview_ = withoutFull(all_, renderer->preview());
    if (descends()) {
      settings_ = oneByOne(knobs_);
      add(preview_);
    } else {
      for (Setting& setting : combinations(swept(all_, options, !options.onlyGiven)))
        add(withoutFull(all_, std::move(setting)));
    }
    for (const Setting& setting : settings_) turn(*renderer, setting);
    rest_.emplace(capture, rig_, warp::chainWarp({}), options.frames, progress);
    if (bent) {
      const scene::Script script = scene::readScript(bent->script, rig_.origin);
      bent_.emplace(bent->capture, rig_, scene::warpAt(script, scene::shotTime(script, bent->frame)),
                    options.frames, progress);
      deformation_ = fmt::format("{} at {}", hex(script.hash), bent->frame);
    }
    for (const Setting& setting : settings_) keys_[setting] = keyOf(*renderer, setting);
  }
  Subject(const Subject&) = delete;
  Subject& operator=(const Subject&) = delete;

  const fs::path& model() const { return model_; }
  const std::vector<Knob>& knobs() const { return knobs_; }
  const std::vector<Setting>& settings() const { return settings_; }
  const Samples& rest() const { return *rest_; }
  const std::optional<Samples>& bent() const { return bent_; }
  // Returns whether the chart itself looks for settings.
  bool descends() const { return options_.sweep.empty() && !options_.onlyGiven; }

  // Measures the pictures of settings that are not known, beginning with the given one. `done` is called
  // after each.
  void measureAccuracy(size_t first, const std::function<void()>& done, const Progress& progress) {
    for (size_t i = first; i < settings_.size(); ++i) {
      const std::string& key = keys_.at(settings_[i]);
      if (!measurements_.accuracy(key)) measurements_.keep(key, accuracyOf(settings_[i], progress));
      done();
    }
  }

  // Adds the settings of a greedy descent.
  void descend(const Progress& progress) {
    std::unique_ptr<render::Renderer> renderer = open(progress);
    const std::vector<Setting> path = descent(knobs_, options_.descentSteps, [&](const Setting& setting) {
      const std::string key = timingKey(keyOf(*renderer, setting));
      if (const auto known = measurements_.cost(key)) return *known;
      const Cost cost = quickCost(*renderer, setting, progress);
      measurements_.keep(key, cost);
      return cost;
    });
    for (const Setting& setting : path) {
      add(setting);
      keys_[setting] = keyOf(*renderer, setting);
    }
  }

  bool isTimed(const Setting& setting) const {
    return measurements_.timing(timingKey(keys_.at(setting))).has_value();
  }
  void keepTiming(const Setting& setting, const Timing& timing) {
    measurements_.keep(timingKey(keys_.at(setting)), timing);
  }
  size_t timedFrames() const { return std::min(options_.timedFrames, rest_->all().size()); }
  // Frame of timing, spread over the frames at rest.
  const Sample& timed(size_t i) const { return rest_->all()[i * rest_->all().size() / timedFrames()]; }

  Point pointOf(const Setting& setting) const {
    const Accuracy accuracy = *measurements_.accuracy(keys_.at(setting));
    const Timing timing = *measurements_.timing(timingKey(keys_.at(setting)));
    Point point;
    point.model = model_;
    point.setting = setting;
    if (!setting.empty() && setting == preview_) point.name = kPreviewName;
    point.command = options_.commandOf(model_, setting);
    point.rest = accuracy.rest;
    point.bent = accuracy.bent;
    point.rmsToFull = accuracy.rmsToFull;
    point.milliseconds = timing.milliseconds;
    point.stages = timing.stages;
    point.bytesRead = accuracy.bytesRead;
    point.modelBytes = bytesIn(model_);
    point.memoryBytes = accuracy.memoryBytes;
    return point;
  }

  std::vector<Panel> panels(const Setting& setting, render::Renderer& renderer,
                            const Progress& progress) const {
    std::vector<Panel> panels;
    turn(renderer, setting);
    for (const Samples* samples : {&*rest_, bent_ ? &*bent_ : nullptr}) {
      if (!samples) continue;
      const Sample& sample = samples->all()[samples->brightest()];
      panels.push_back(
          panelOf(sample, rendered(renderer, sample.scene, setting, progress).color, samples->exposure()));
      if (samples != &*rest_) panels.back().frame += ", deformed";
    }
    return panels;
  }

  std::unique_ptr<render::Renderer> open(const Progress& progress) const {
    return render::openRenderer(model_, options_.renderer, progress);
  }

private:
  void add(const Setting& setting) {
    if (std::ranges::find(settings_, setting) == settings_.end()) settings_.push_back(setting);
  }

  // Names everything that the accuracy of a setting depends on.
  std::string keyOf(render::Renderer& renderer, const Setting& setting) const {
    turn(renderer, setting);
    const std::string text =
        fmt::format("surflect {} {} scale {} cache {} rest {} bent {} by {}", kVersion,
                    renderer.describe().identity, scaleOf(setting), options_.renderer.cacheBytes,
                    rest_->hash(), bent_ ? bent_->hash() : 0, deformation_);
    return hex(contentHash(std::as_bytes(std::span(text)))) + " " + knobs::textOf(setting);
  }

  std::string timingKey(const std::string& key) const {
    return fmt::format("{} {} frames {} rounds on {}", key, timedFrames(), options_.rounds, options_.machine);
  }

  // Calls back for each frame, at rest and deformed.
  template <class Visit> void forEachSample(Visit visit) const {
    for (const Samples* samples : {&*rest_, bent_ ? &*bent_ : nullptr})
      if (samples)
        for (const Sample& sample : samples->all()) visit(*samples, sample);
  }

  // Pictures of the most accurate setting, in the order of forEachSample.
  const std::vector<image::Image>& fullPictures(const Progress& progress) {
    if (full_.empty()) {
      const auto renderer = open(progress);
      forEachSample([&](const Samples&, const Sample& sample) {
        full_.push_back(renderer->render(sample.scene, {}, progress).color);
      });
    }
    return full_;
  }

  Accuracy accuracyOf(const Setting& setting, const Progress& progress) {
    const std::vector<image::Image>& full = fullPictures(progress);
    forgetPeakMemory();
    const auto renderer = open(progress); // with an empty cache
    turn(*renderer, setting);
    Accuracy accuracy;
    PooledAgreement rest, deformed;
    RelativeRms rms;
    size_t i = 0;
    forEachSample([&](const Samples& samples, const Sample& sample) {
      const render::FrameLayers layers = rendered(*renderer, sample.scene, setting, progress);
      (&samples == &*rest_ ? rest : deformed).add(sample.truth, layers.color, samples.exposure());
      rms.add(layers.color, full[i++]);
      const auto bytes = layers.report.counts.find("bytes_read");
      if (bytes != layers.report.counts.end()) accuracy.bytesRead += bytes->second;
    });
    accuracy.rest = rest.agreement();
    if (bent_) accuracy.bent = deformed.agreement();
    accuracy.rmsToFull = rms.value();
    accuracy.bytesRead /= static_cast<double>(i);
    accuracy.memoryBytes = static_cast<size_t>(memoryUse().peakBytes);
    return accuracy;
  }

  // Cost over the timed frames: each frame's least time of a few, for the comparison of steps.
  Cost quickCost(render::Renderer& renderer, const Setting& setting, const Progress& progress) {
    constexpr int kRepeats = 3;
    const std::vector<image::Image>& full = fullPictures(progress);
    turn(renderer, setting);
    Cost cost;
    RelativeRms rms;
    for (size_t i = 0; i < timedFrames(); ++i) {
      const scene::Scene scene = scaled(timed(i).scene, scaleOf(setting));
      rms.add(rendered(renderer, timed(i).scene, setting, progress).color,
              full[static_cast<size_t>(&timed(i) - rest_->all().data())]);
      double least = std::numeric_limits<double>::infinity();
      for (int repeat = 0; repeat < kRepeats; ++repeat) {
        const Stopwatch watch;
        renderer.render(scene, {}, progress);
        least = std::min(least, watch.seconds());
      }
      cost.milliseconds += 1e3 * least / static_cast<double>(timedFrames());
    }
    cost.error = rms.value();
    return cost;
  }

  fs::path model_;
  const ChartOptions& options_;
  Measurements& measurements_;
  capture::Capture rig_;
  std::vector<Knob> all_, knobs_; // of the renderer; those that are swept
  Setting preview_;
  std::vector<Setting> settings_;
  std::map<Setting, std::string> keys_;
  std::optional<Samples> rest_, bent_;
  std::string deformation_; // names the warp of the bent samples
  std::vector<image::Image> full_;
};

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
  std::map<const Subject*, std::unique_ptr<render::Renderer>> renderers;
  for (const auto& subject : subjects)
    for (const Setting& setting : subject->settings()) {
      if (subject->isTimed(setting)) continue;
      if (!renderers[subject.get()]) renderers[subject.get()] = subject->open(quiet);
      const size_t frames = subject->timedFrames();
      all.push_back({subject.get(), setting, std::vector<std::vector<double>>(frames), {}});
      all.back().stages.resize(frames);
    }
  render::FrameLayers layers;
  for (size_t round = 0; round <= rounds; ++round)
    for (size_t k = 0; k < all.size(); ++k) {
      progress("time",
               static_cast<double>(round * all.size() + k) / static_cast<double>((rounds + 1) * all.size()));
      Times& times = all[round % 2 ? all.size() - 1 - k : k];
      render::Renderer& renderer = *renderers.at(times.subject);
      turn(renderer, times.setting);
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
    std::unique_ptr<render::Renderer> renderer;
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
void addKnobs(std::vector<Knob>& all, const std::vector<Knob>& knobs) {
  for (const Knob& knob : knobs) {
    const auto found = std::ranges::find(all, knob.name, &Knob::name);
    if (found == all.end()) {
      all.push_back(knob);
      continue;
    }
    for (const double value : knob.values)
      if (std::ranges::find(found->values, value) == found->values.end()) found->values.push_back(value);
  }
}

std::string nameOf(const fs::path& folder) {
  return (folder.has_filename() ? folder.filename() : folder.parent_path().filename()).string();
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
    if (subjects.back()->descends()) steps += longestDescent(subjects.back()->knobs(), options.descentSteps);
  }

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
  size_t measured = 0;
  for (const auto& subject : subjects) {
    const auto done = [&] {
      progress("accuracy", static_cast<double>(++measured) / static_cast<double>(points + steps));
    };
    subject->measureAccuracy(0, done, quiet);
    if (!subject->descends()) continue;
    const size_t known = subject->settings().size();
    subject->descend(quiet);
    subject->measureAccuracy(known, done, quiet);
  }
  measureTimes(subjects, options.rounds, progress);

  for (const auto& subject : subjects) {
    addKnobs(chart.knobs, subject->knobs());
    for (const Setting& setting : subject->settings()) chart.points.push_back(subject->pointOf(setting));
    chart.title += (chart.title.empty() ? "" : ", ") + nameOf(subject->model());
  }
  chart.title += " on " + nameOf(capture.folder());
  markFront(chart.points);
  markChosen(chart.points);
  addPanels(chart, subjects, quiet);
  progress("time", 1);
  return chart;
}

} // namespace surflect::chart
