#include "render/chart/subject.h"

#include "render/chart/front.h"
#include "render/chart/measurements.h"
#include "render/evaluation/evaluate.h"
#include "render/methods.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory.h"
#include "surfel/base/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace surflect::chart {

namespace fs = std::filesystem;
using method::Option, method::Setting, method::Value;

double scaleOf(const Setting& setting) {
  const auto found = setting.find(kScale);
  return found == setting.end() ? 1 : found->second.number();
}

const Option& scaleOption() {
  static const Option kOption{.name = kScale,
                              .domain = method::Range{0.01, 1},
                              .standard = 1,
                              .sweep = {1, 0.75, 0.5},
                              .help = "size of the rendered picture, enlarged before it is compared"};
  return kOption;
}

namespace {

// The options of a renderer that `held` does not fix, and the scale.
std::vector<Option> optionsOf(const method::Renderer& renderer, const Setting& held) {
  std::vector<Option> options(renderer.options().begin(), renderer.options().end());
  std::erase_if(options, [&](const Option& option) { return held.contains(option.name); });
  options.push_back(scaleOption());
  return options;
}

// The knobs to sweep with the values to try; the most accurate value comes first or, unless `withFull`, only
// where it was asked for.
std::vector<Option> swept(const std::vector<Option>& all, const Setting& held, const ChartOptions& options,
                          bool withFull) {
  if (options.sweep.empty() && !options.onlyGiven) return method::sweepable(all, held);
  std::vector<Option> chosen;
  for (const method::Sweep& asked : options.sweep) {
    const auto row = std::ranges::find(all, asked.name, &Option::name);
    if (row == all.end()) continue; // of another method
    Option knob = *row;
    if (!knob.standard && knob.sweep.empty())
      throw Error("has no default to compare with").at(method::flagOf(asked.name));
    const Value full = knob.standard ? *knob.standard : knob.sweep.front();
    knob.sweep.clear();
    if (withFull) knob.sweep.push_back(full);
    for (const Value& value : asked.values)
      if (std::ranges::find(knob.sweep, value) == knob.sweep.end()) knob.sweep.push_back(value);
    chosen.push_back(std::move(knob));
  }
  return chosen;
}

// Throws Error for a sweep that nobody can wait for, before its settings fill the memory.
void requireFew(const std::vector<Option>& knobs) {
  constexpr double kMost = 10000;
  const double count =
      std::accumulate(knobs.begin(), knobs.end(), 1.0, [](double product, const Option& knob) {
        return product * static_cast<double>(knob.sweep.size());
      });
  if (count > kMost)
    throw Error::mismatch(fmt::format("at most {} combinations of all values", kMost), numberText(count))
        .at("--sweep");
}

// A picture of the scene's size, rendered with the scale of a setting to which the renderer has been turned.
method::FrameLayers rendered(method::Renderer& renderer, const scene::Scene& scene, const Setting& setting,
                             const Progress& progress) {
  method::FrameLayers layers = renderer.render(scaled(scene, scaleOf(setting)), {}, progress);
  layers.color = enlarged(std::move(layers.color), scene.camera.lens.width, scene.camera.lens.height);
  return layers;
}

// Estimated work of all stages of a frame.
double workOf(const method::FrameReport& report) {
  double work = 0;
  for (const auto& [name, count] : report.counts)
    if (name.starts_with("work.")) work += count;
  if (!(work > 0)) throw Error("the renderer has options to sweep, but its frames report no work");
  return work;
}

} // namespace

Subject::Subject(fs::path model, const capture::Capture& capture, const std::optional<BentTruth>& bent,
                 const ChartOptions& options, Measurements& measurements, const Progress& progress)
    : model_(std::move(model)), options_(options), measurements_(measurements) {
  const auto held = options.settings.find(method::methodOfModel(model_).tag);
  if (held != options.settings.end()) held_ = held->second;
  for (const method::Sweep& sweep : options.sweep) held_.erase(sweep.name);
  const auto renderer = open(progress);
  rig_ = renderer->describe().rig;
  mismatches_ = evaluation::rigMismatches(renderer->describe(), capture);
  all_ = optionsOf(*renderer, held_);
  knobs_ = swept(all_, held_, options, true);
  preview_ = withoutFull(all_, method::settingOf(method::Preset::preview, all_));
  if (isGiven()) {
    const std::vector<Option> given = swept(all_, held_, options, !options.onlyGiven);
    requireFew(given);
    for (Setting& setting : combinations(given)) add(withoutFull(all_, std::move(setting)));
  } else {
    settings_ = oneByOne(knobs_);
    add(preview_);
  }
  for (const Setting& setting : settings_) set(*renderer, setting);
  rest_.emplace(capture, rig_, warp::chainWarp({}), options.frames, progress);
  if (bent) {
    const scene::Script script = scene::readScript(bent->script, rig_.origin);
    bent_.emplace(bent->capture, rig_, scene::warpAt(script, scene::shotTime(script, bent->frame)),
                  options.frames, progress);
    deformation_ = fmt::format("{} at {}", hex(script.hash), bent->frame);
  }
  for (const Setting& setting : settings_) keys_[setting] = keyOf(*renderer, setting);
}

void Subject::set(method::Renderer& renderer, Setting setting) const {
  if (const auto scale = setting.find(kScale); scale != setting.end()) {
    method::requireSetting({"this chart", {&scaleOption(), 1}}, {*scale});
    setting.erase(scale);
  }
  setting.insert(held_.begin(), held_.end());
  renderer.set(method::forFrames(renderer.options(), setting));
}

std::unique_ptr<method::Renderer> Subject::open(const Progress& progress) const {
  return method::openRenderer(model_, held_, progress);
}

void Subject::add(const Setting& setting) {
  if (std::ranges::find(settings_, setting) == settings_.end()) settings_.push_back(setting);
}

// Names everything that the accuracy of a setting depends on.
std::string Subject::keyOf(method::Renderer& renderer, const Setting& setting) const {
  set(renderer, setting);
  const std::string text = fmt::format("surflect {} {} scale {} given {} rest {} bent {} by {}", kVersion,
                                       renderer.describe().identity, scaleOf(setting), method::textOf(held_),
                                       rest_->hash(), bent_ ? bent_->hash() : 0, deformation_);
  return hex(contentHash(std::as_bytes(std::span(text)))) + " " + method::textOf(setting);
}

std::string Subject::timingKey(const Setting& setting) const {
  return fmt::format("{} {} frames {} rounds on {}", keys_.at(setting), timedFrames(), options_.rounds,
                     options_.machine);
}

// Calls back for each frame, at rest and deformed.
template <class Visit> void Subject::forEachSample(Visit visit) const {
  for (const Samples* samples : {&*rest_, bent_ ? &*bent_ : nullptr})
    if (samples)
      for (const Sample& sample : samples->all()) visit(*samples, sample);
}

// Pictures of the most accurate setting, in the order of forEachSample.
const std::vector<image::Image>& Subject::fullPictures(const Progress& progress) {
  if (full_.empty()) {
    const auto renderer = open(progress);
    forEachSample([&](const Samples&, const Sample& sample) {
      full_.push_back(renderer->render(sample.scene, {}, progress).color);
    });
  }
  return full_;
}

size_t Subject::longestDescent() const {
  return isGiven() || knobs_.size() == 1 ? 0 : chart::longestDescent(knobs_, options_.descentSteps);
}

void Subject::descend(const Progress& progress) {
  const size_t steps = longestDescent();
  if (steps == 0) return;
  const Progress quiet{{}, progress.cancelled};
  const auto renderer = open(quiet);
  size_t asked = 0; // of at most 1 + steps * knobs settings
  const std::vector<Setting> path = descent(knobs_, steps, [&](const Setting& setting) {
    progress("descent", static_cast<double>(++asked) / static_cast<double>(1 + steps * knobs_.size()));
    return costOf(*renderer, setting, quiet);
  });
  for (const Setting& setting : path) {
    add(setting);
    keys_[setting] = keyOf(*renderer, setting);
  }
}

Cost Subject::costOf(method::Renderer& renderer, const Setting& setting, const Progress& progress) {
  const std::string key = fmt::format("{} {} frames", keyOf(renderer, setting), timedFrames());
  std::optional<Cost> cost = measurements_.cost(key);
  if (!cost) measurements_.keep(key, cost.emplace(measuredCost(renderer, setting, progress)));
  return *cost;
}

// Mean work and pooled error over the timed frames.
Cost Subject::measuredCost(method::Renderer& renderer, const Setting& setting, const Progress& progress) {
  const std::vector<image::Image>& full = fullPictures(progress);
  set(renderer, setting);
  Cost cost;
  RelativeRms rms;
  for (size_t i = 0; i < timedFrames(); ++i) {
    const method::FrameLayers layers = rendered(renderer, timed(i).scene, setting, progress);
    rms.add(layers.color, full[static_cast<size_t>(&timed(i) - rest_->all().data())]);
    cost.work += workOf(layers.report) / static_cast<double>(timedFrames());
  }
  cost.error = rms.value();
  return cost;
}

void Subject::measureAccuracy(const std::function<void()>& done, const Progress& progress) {
  for (const Setting& setting : settings_) {
    const std::string& key = keys_.at(setting);
    if (!measurements_.accuracy(key)) measurements_.keep(key, accuracyOf(setting, progress));
    done();
  }
  if (!isGiven()) leaveOutIdle(progress);
  full_ = {}; // so that it does not count as memory of the models that follow
}

void Subject::leaveOutIdle(const Progress& progress) {
  const auto renderer = open(progress);
  const double work = costOf(*renderer, {}, progress).work;
  for (const Option& knob : knobs_) {
    const auto isAlone = [&](const Setting& setting) {
      return setting.size() == 1 && setting.contains(knob.name) && setting != preview_;
    };
    const auto isIdle = [&](const Setting& setting) {
      return !isAlone(setting) || (measurements_.accuracy(keys_.at(setting))->rmsToFull == 0 &&
                                   costOf(*renderer, setting, progress).work == work);
    };
    if (std::ranges::all_of(settings_, isIdle) && std::erase_if(settings_, isAlone) > 0)
      idle_.push_back(knob.name);
  }
}

Accuracy Subject::accuracyOf(const Setting& setting, const Progress& progress) {
  const std::vector<image::Image>& full = fullPictures(progress);
  forgetPeakMemory();
  const auto renderer = open(progress); // with an empty cache
  set(*renderer, setting);
  Accuracy accuracy;
  PooledAgreement rest, deformed;
  RelativeRms rms;
  size_t i = 0;
  forEachSample([&](const Samples& samples, const Sample& sample) {
    const method::FrameLayers layers = rendered(*renderer, sample.scene, setting, progress);
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

size_t Subject::timedFrames() const { return std::min(options_.timedFrames, rest_->all().size()); }

const Sample& Subject::timed(size_t i) const { return rest_->all()[i * rest_->all().size() / timedFrames()]; }

bool Subject::isTimed(const Setting& setting) const {
  return measurements_.timing(timingKey(setting)).has_value();
}

void Subject::keepTiming(const Setting& setting, const Timing& timing) {
  measurements_.keep(timingKey(setting), timing);
}

Point Subject::pointOf(const Setting& setting) const {
  const Accuracy accuracy = *measurements_.accuracy(keys_.at(setting));
  const Timing timing = *measurements_.timing(timingKey(setting));
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

std::vector<Panel> Subject::panels(const Setting& setting, method::Renderer& renderer,
                                   const Progress& progress) const {
  std::vector<Panel> panels;
  set(renderer, setting);
  for (const Samples* samples : {&*rest_, bent_ ? &*bent_ : nullptr}) {
    if (!samples) continue;
    const Sample& sample = samples->all()[samples->brightest()];
    panels.push_back(
        panelOf(sample, rendered(renderer, sample.scene, setting, progress).color, samples->exposure()));
    if (samples != &*rest_) panels.back().frame += ", deformed";
  }
  return panels;
}

} // namespace surflect::chart
