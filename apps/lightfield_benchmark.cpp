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
  std::string script;
  int rounds = 1;
  double scale = 1;
  render::RendererOptions options;
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

Json runBenchmark(const BenchmarkArguments& arguments, const Progress& progress) {
  const scene::ScriptHead head = scene::readScriptHead(arguments.script);
  TimedRenderer renderer(render::openRenderer(head.model, arguments.options, progress));
  const scene::Script script = scene::readScript(arguments.script, renderer.describe().rig.origin);
  scene::requireShot(script);
  film::ShotRenderer shot(script, renderer, progress);
  const int first = script.frames->first, last = script.frames->last;
  for (int round = 0; round < arguments.rounds; ++round)
    for (int frame = first; frame <= last; ++frame) {
      progress("benchmark",
               (round + static_cast<double>(frame - first) / (last - first + 1)) / arguments.rounds);
      shot.reuse(shot.render(frame, arguments.scale));
    }
  Json report = {{"model", head.model.string()}, {"frames", renderer.seconds().size()}};
  std::vector<double> milliseconds;
  for (const double seconds : renderer.seconds()) milliseconds.push_back(1e3 * seconds);
  say(fmt::format("{:<28} {:>14} {:>14} {:>14}", "", "least", "median", "most"));
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
  return report;
}

} // namespace

void addLightFieldBenchmark(CLI::App& lightField, CommandWork& work) {
  auto arguments = std::make_shared<BenchmarkArguments>();
  CLI::App* command = lightField.add_subcommand(
      "benchmark", "time the frames of a script one after another, without writing pictures");
  command->footer("Example: surflect lightfield benchmark orbit.toml --rounds 3 --json");
  command->add_option("script", arguments->script, "TOML: model and camera over time")->required();
  command->add_option("--rounds", arguments->rounds, "how often all frames are rendered")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  command->add_option("--scale", arguments->scale, "factor on width and height")
      ->capture_default_str()
      ->check(finiteIn(0.01, 8));
  addModelOptions(*command, arguments->options);
  setWork(*command, work, "nothing was kept",
          [arguments](const Progress& progress) { return runBenchmark(*arguments, progress); });
}

} // namespace surflect
