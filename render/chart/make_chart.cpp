#include "render/chart/make_chart.h"

#include "render/chart/front.h"
#include "render/chart/measurements.h"
#include "render/chart/report.h"
#include "render/chart/samples.h"
#include "render/chart/subject.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"
#include "surfel/math/median.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cassert>
#include <set>

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
  constexpr const char* kMeasurements = "measurements.jsonl";
  removeAbandoned(folder, [](const std::string& name) {
    return name == kMeasurements || name == "chart.csv" || name == "chart.json" || name == "index.html";
  });
  Measurements measurements(folder / kMeasurements);
  std::vector<std::unique_ptr<Subject>> subjects;
  size_t points = 0, steps = 0;
  for (const fs::path& model : models) {
    subjects.push_back(std::make_unique<Subject>(model, capture, bent, options, measurements, progress));
    points += subjects.back()->settings().size();
    steps += subjects.back()->longestDescent();
    for (const std::string& mismatch : subjects.back()->mismatches())
      options.announce(fmt::format("warning: {}: {}", model.string(), mismatch));
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

namespace {

using OrderedJson = nlohmann::ordered_json;

// A field of a CSV file, quoted where it must be.  [RFC 4180]
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string doubled;
  for (const char c : text) doubled.append(c == '"' ? 2 : 1, c);
  return fmt::format("\"{}\"", doubled);
}

std::string numberOf(double number) { return fmt::format("{}", number); }

OrderedJson agreementJson(const Agreement& agreement) {
  return {{"psnr_linear_db", agreement.psnrLinearDb},
          {"psnr_srgb_db", agreement.psnrSrgbDb},
          {"ssim_srgb", agreement.ssim},
          {"flip", agreement.flip}};
}

std::vector<std::string> fieldsOf(const std::optional<Agreement>& agreement) {
  if (!agreement) return std::vector<std::string>(4);
  return {numberOf(agreement->psnrLinearDb), numberOf(agreement->psnrSrgbDb), numberOf(agreement->ssim),
          numberOf(agreement->flip)};
}

method::Value valueOf(const method::Option& knob, const method::Setting& setting) {
  const auto found = setting.find(knob.name);
  return found == setting.end() ? knob.sweep.front() : found->second;
}

OrderedJson jsonOf(const method::Value& value) {
  return value.isNumber() ? OrderedJson(value.number()) : OrderedJson(value.text());
}

OrderedJson jsonOf(const method::Setting& setting) {
  OrderedJson json = OrderedJson::object();
  for (const auto& [name, value] : setting) json[name] = jsonOf(value);
  return json;
}

OrderedJson knobJson(const method::Option& knob) {
  OrderedJson json = {{"name", knob.name}, {"help", knob.help}, {"values", OrderedJson::array()}};
  for (const method::Value& value : knob.sweep) json["values"].push_back(jsonOf(value));
  return json;
}

} // namespace

std::string csvOf(const Chart& chart) {
  std::set<std::string> stages;
  for (const Point& point : chart.points)
    for (const auto& [stage, milliseconds] : point.stages) stages.insert(stage);
  std::vector<std::string> names = {"model", "setting", "name"};
  for (const method::Option& knob : chart.knobs) names.push_back("knob_" + knob.name);
  for (const char* frames : {"rest", "bent"})
    for (const char* measure : {"psnr_linear_db", "psnr_srgb_db", "ssim_srgb", "flip"})
      names.push_back(fmt::format("{}_{}", frames, measure));
  names.insert(names.end(), {"rms_to_full", "frame_ms"});
  for (const std::string& stage : stages) names.push_back(stage + "_ms");
  names.insert(names.end(),
               {"read_bytes_per_frame", "model_bytes", "memory_peak_bytes", "on_front", "chosen", "command"});

  std::string text;
  const auto addRow = [&](const std::vector<std::string>& fields) {
    for (size_t i = 0; i < fields.size(); ++i) text.append(i > 0 ? "," : "").append(quoted(fields[i]));
    text += "\r\n";
  };
  addRow(names);
  for (const Point& point : chart.points) {
    std::vector<std::string> row = {point.model.string(), method::textOf(point.setting), point.name};
    for (const method::Option& knob : chart.knobs) row.push_back(valueOf(knob, point.setting).text());
    for (const auto& agreement : {std::optional(point.rest), point.bent})
      std::ranges::copy(fieldsOf(agreement), std::back_inserter(row));
    row.push_back(numberOf(point.rmsToFull));
    row.push_back(numberOf(point.milliseconds));
    for (const std::string& stage : stages) {
      const auto found = point.stages.find(stage);
      row.push_back(found == point.stages.end() ? "" : numberOf(found->second));
    }
    row.push_back(numberOf(point.bytesRead));
    row.push_back(std::to_string(point.modelBytes));
    row.push_back(std::to_string(point.memoryBytes));
    row.push_back(point.isOnFront ? "1" : "0");
    row.push_back(point.isChosen ? "1" : "0");
    row.push_back(point.command);
    addRow(row);
  }
  return text;
}

std::string jsonOf(const Chart& chart) {
  OrderedJson json = {{"title", chart.title},
                      {"machine", chart.machine},
                      {"command", chart.command},
                      {"rest_frames", chart.restFrames},
                      {"bent_frames", chart.bentFrames},
                      {"rest_frames_held_out", chart.restHeldOut},
                      {"bent_frames_held_out", chart.bentHeldOut},
                      {"knobs", OrderedJson::array()},
                      {"idle_knobs", OrderedJson::object()},
                      {"points", OrderedJson::array()}};
  for (const method::Option& knob : chart.knobs) json["knobs"].push_back(knobJson(knob));
  for (const auto& [model, idle] : chart.idleKnobs) json["idle_knobs"][model.string()] = idle;
  for (const Point& point : chart.points) {
    OrderedJson entry = {{"model", point.model.string()},
                         {"setting", jsonOf(point.setting)},
                         {"name", point.name},
                         {"command", point.command},
                         {"rest", agreementJson(point.rest)}};
    if (point.bent) entry["bent"] = agreementJson(*point.bent);
    entry.update({{"rms_to_full", point.rmsToFull},
                  {"frame_ms", point.milliseconds},
                  {"stages_ms", point.stages},
                  {"read_bytes_per_frame", point.bytesRead},
                  {"model_bytes", point.modelBytes},
                  {"memory_peak_bytes", point.memoryBytes},
                  {"on_front", point.isOnFront},
                  {"chosen", point.isChosen}});
    json["points"].push_back(std::move(entry));
  }
  return json.dump(2, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

void writeChart(const Chart& chart, const std::filesystem::path& folder) {
  writeFileAtomically(folder / "chart.csv", csvOf(chart));
  writeFileAtomically(folder / "chart.json", jsonOf(chart));
  writeFileAtomically(folder / "index.html", htmlOf(chart));
}

} // namespace surflect::chart
