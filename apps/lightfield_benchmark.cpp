#include "apps/lightfield_command.h"
#include "apps/model_options.h"
#include "apps/terminal.h"
#include "apps/timed_renderer.h"
#include "render/film/shot_renderer.h"
#include "render/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace surflect {

namespace {

struct BenchmarkArguments {
  std::vector<std::string> scripts;
  int rounds = 1;
  double scale = 1;
  render::RendererOptions options;
  knobs::Setting setting;
};

// A script's model, and its frames as they are rendered.
struct TimedShot {
  std::string path;
  scene::ScriptHead head;
  TimedRenderer renderer;
  scene::Script script;
  film::ShotRenderer shot;

  TimedShot(const std::string& file, const BenchmarkArguments& arguments, const Progress& progress)
      : path(file), head(scene::readScriptHead(file)),
        renderer(render::openRenderer(head.model, arguments.options, progress)),
        script(scene::readScript(file, renderer.describe().rig.origin)),
        shot(checked(script), renderer, progress) {
    renderer.turn(arguments.setting);
  }

private:
  static const scene::Script& checked(const scene::Script& script) {
    scene::requireShot(script);
    return script;
  }
};

// Minimum, median and maximum of a figure over frames.
Json spreadOf(std::vector<double> values) {
  std::ranges::sort(values);
  return {{"least", values.front()}, {"median", values[values.size() / 2]}, {"most", values.back()}};
}

void saySpread(const std::string& name, const Json& spread) {
  say(fmt::format("{:<28} {:>14.3f} {:>14.3f} {:>14.3f}", name, spread["least"].get<double>(),
                  spread["median"].get<double>(), spread["most"].get<double>()));
}

Json reportOf(const TimedShot& timed) {
  const TimedRenderer& renderer = timed.renderer;
  Json report = {{"script", timed.path},
                 {"model", timed.head.model.string()},
                 {"frames", renderer.seconds().size()},
                 {"model_counts", renderer.describe().counts}};
  std::vector<double> milliseconds;
  for (const double seconds : renderer.seconds()) milliseconds.push_back(1e3 * seconds);
  say(fmt::format("{:<28} {:>14} {:>14} {:>14}", timed.head.model.filename().string(), "least", "median",
                  "most"));
  report["frame_ms"] = spreadOf(milliseconds);
  saySpread("frame, ms", report["frame_ms"]);
  std::map<std::string, std::vector<double>> stages, counts;
  for (const render::FrameReport& frame : renderer.reports()) {
    for (const auto& [stage, seconds] : frame.seconds) stages[stage].push_back(1e3 * seconds);
    for (const auto& [name, count] : frame.counts) counts[name].push_back(count);
  }
  for (auto& [stage, values] : stages) {
    report["stage_ms"][stage] = spreadOf(std::move(values));
    saySpread("  " + stage + ", ms", report["stage_ms"][stage]);
  }
  for (auto& [name, values] : counts) {
    report["counts"][name] = spreadOf(std::move(values));
    saySpread(name, report["counts"][name]);
  }
  for (const auto& [name, count] : renderer.describe().counts)
    say(fmt::format("{:<28} {:>14}", "model: " + name, count));
  return report;
}

Json runBenchmark(const BenchmarkArguments& arguments, const Progress& progress) {
  std::vector<std::unique_ptr<TimedShot>> shots;
  for (const std::string& script : arguments.scripts)
    shots.push_back(std::make_unique<TimedShot>(script, arguments, progress));
  const auto steps = static_cast<double>(static_cast<size_t>(arguments.rounds) * shots.size());
  size_t step = 0;
  for (int round = 0; round < arguments.rounds; ++round)
    for (const auto& timed : shots) {
      progress("benchmark", static_cast<double>(step++) / steps);
      for (int frame = timed->script.frames->first; frame <= timed->script.frames->last; ++frame)
        timed->shot.reuse(timed->shot.render(frame, arguments.scale));
    }
  Json reports = Json::array();
  for (const auto& timed : shots) reports.push_back(reportOf(*timed));
  return {{"scripts", std::move(reports)}};
}

} // namespace

void addLightFieldBenchmark(CLI::App& lightField, CommandWork& work) {
  auto arguments = std::make_shared<BenchmarkArguments>();
  CLI::App* command = lightField.add_subcommand(
      "benchmark", "time the frames of scripts one after another, without writing pictures");
  command->footer("Example: surflect lightfield benchmark orbit.toml --rounds 3 --json");
  command->add_option("scripts", arguments->scripts, "TOML: model and camera over time")->required();
  command->add_option("--rounds", arguments->rounds, "how often all frames are rendered; scripts take turns")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  command->add_option("--scale", arguments->scale, "factor on width and height")
      ->capture_default_str()
      ->check(finiteIn(0.01, 8));
  addModelOptions(*command, arguments->options);
  addKnobOption(*command, arguments->setting);
  setWork(*command, work, "nothing was kept",
          [arguments](const Progress& progress) { return runBenchmark(*arguments, progress); });
}

} // namespace surflect
