// Times the frames of scripts one after another, in turn, without writing pictures; prints JSON on stdout and
// a table on stderr. scripts/light_fields and scripts/opacity write the tables of docs/results/.
#include "render/film/shot_renderer.h"
#include "render/method/timed_renderer.h"
#include "render/methods.h"
#include "render/scene/scene.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <memory>
#include <sstream>

namespace surflect::bench {

namespace {

using Json = nlohmann::ordered_json;

void say(const std::string& line) { fmt::print(stderr, "{}\n", line); }

struct BenchmarkArguments {
  std::vector<std::string> scripts;
  int rounds = 1;
  double scale = 1;
  std::vector<std::string> options; // NAME=VALUE
};

// "SCRIPT", or "SCRIPT:NAME=VALUE:NAME=VALUE.." with options of its frames.
struct ScriptArgument {
  std::string path;
  std::vector<std::string> options;

  explicit ScriptArgument(const std::string& text) {
    std::istringstream parts(text);
    std::getline(parts, path, ':');
    for (std::string option; std::getline(parts, option, ':');) options.push_back(option);
  }
};

// The setting of a model; options that its method lacks are for others.
method::Setting settingOf(std::vector<std::string> options, const std::vector<std::string>& own,
                          const std::filesystem::path& model) {
  const method::Method& method = method::methodOfModel(model);
  method::Setting setting;
  options.insert(options.end(), own.begin(), own.end());
  for (const std::string& text : options)
    if (const std::string name = text.substr(0, text.find('='));
        std::ranges::find(method.renderOptions, name, &method::Option::name) != method.renderOptions.end())
      setting[name] = method::parseSweep({method.tag, method.renderOptions}, text).values.front();
  return setting;
}

// A script's model, and its frames as they are rendered.
struct TimedShot {
  std::string name; // the argument
  scene::ScriptHead head;
  method::TimedRenderer renderer;
  scene::Script script;
  film::ShotRenderer shot;

  TimedShot(const std::string& text, const BenchmarkArguments& arguments, const Progress& progress)
      : TimedShot(text, ScriptArgument(text), arguments, progress) {}

private:
  TimedShot(const std::string& text, const ScriptArgument& argument, const BenchmarkArguments& arguments,
            const Progress& progress)
      : name(text), head(scene::readScriptHead(argument.path)),
        renderer(method::openRenderer(head.model, settingOf(arguments.options, argument.options, head.model),
                                      progress)),
        script(scene::readScript(argument.path, renderer.describe().rig.origin)),
        shot(checked(script), renderer, progress) {}

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
  const method::TimedRenderer& renderer = timed.renderer;
  Json report = {{"script", timed.name},
                 {"model", timed.head.model.string()},
                 {"frames", renderer.seconds().size()},
                 {"model_counts", renderer.describe().counts}};
  std::vector<double> milliseconds;
  for (const double seconds : renderer.seconds()) milliseconds.push_back(1e3 * seconds);
  say(fmt::format("{}\n{:<28} {:>14} {:>14} {:>14}", timed.name, "", "least", "median", "most"));
  report["frame_ms"] = spreadOf(milliseconds);
  saySpread("frame, ms", report["frame_ms"]);
  std::map<std::string, std::vector<double>> stages, counts;
  for (const method::FrameReport& frame : renderer.reports()) {
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
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect;
  bench::BenchmarkArguments arguments;
  CLI::App app("Times the frames of scripts, which take turns", "bench_scripts");
  app.add_option("scripts", arguments.scripts,
                 "TOML: model and camera over time; or TOML:NAME=VALUE, with options of its frames")
      ->required();
  app.add_option("--rounds", arguments.rounds, "how often all frames are rendered")
      ->check(CLI::Range(1, 1000));
  app.add_option("--scale", arguments.scale, "factor on width and height")->check(CLI::Range(0.01, 8.0));
  app.add_option("--set", arguments.options, "NAME=VALUE of an option")->allow_extra_args(false);
  CLI11_PARSE(app, argc, argv);
  try {
    fmt::print("{}\n", bench::runBenchmark(arguments, {}).dump(2));
    return 0;
  } catch (const std::exception& error) {
    bench::say(std::string("bench_scripts: ") + error.what());
    return 1;
  }
}
