// Flies a spherical light field along a script's frames, and compares the predicted time of each with its
// true one [Domingo 2007, Figs. 5 and 6]; prints JSON on stdout. scripts/light_fields writes the tables of
// docs/results/.
#include "render/lightfield/spherical/flight.h"
#include "render/scene/scene.h"
#include "surfel/base/error.h"
#include "surfel/math/median.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace surflect::bench {

namespace {

using Json = nlohmann::ordered_json;

void say(const std::string& line) { fmt::print(stderr, "{}\n", line); }

struct FlyArguments {
  std::string script;
  std::optional<double> budgetMs, level;
  bool wait = false, plane = false, single = false;
  int rounds = 1, warmUp = 10, samples = 1;
  size_t memoryMb = 512, gpuMb = 512;
};

scene::Script flownScript(const std::string& path, const Vec3<double>& origin) {
  scene::Script script = scene::readScript(path, origin);
  scene::requireShot(script);
  if (!script.lights.empty() || !script.warps.empty())
    throw Error("has lights or warps: a light field is flown around as it was photographed").in(path);
  if (std::holds_alternative<scene::NamedCamera>(*script.camera))
    throw Error::mismatch("a camera that moves", "one of the model's").at("camera.from").in(path);
  return script;
}

// Acquisition space: nothing is warped.
capture::Camera<AcquisitionSpace> cameraOf(const scene::Script& script, int frame) {
  const capture::Camera<ObjectSpace> camera = scene::cameraAt(script, scene::shotTime(script, frame));
  return {camera.lens, {camera.cameraFromWorld.rotation(), camera.cameraFromWorld.translation()}};
}

Json frameJson(const spherical::FrameRecord& frame) {
  return {{"level", frame.detail.level},           {"coarser_mips", frame.detail.coarser},
          {"predicted_ms", 1e3 * frame.predicted}, {"ms", 1e3 * frame.seconds},
          {"triangles", frame.counts.triangles},   {"images_uploaded", frame.counts.uploads},
          {"images_read", frame.counts.reads},     {"triangles_of_ancestors", frame.counts.substituted}};
}

// Figures over the frames after the warm-up.
Json summaryOf(const std::vector<spherical::FrameRecord>& frames, const FlyArguments& arguments) {
  const auto skipped = std::min(static_cast<size_t>(arguments.warmUp), frames.size() - 1);
  std::vector<double> errors, levels, milliseconds, ancestors;
  double within = 0;
  for (size_t i = skipped; i < frames.size(); ++i) {
    const spherical::FrameRecord& frame = frames[i];
    errors.push_back(std::abs(frame.predicted - frame.seconds) / frame.seconds);
    levels.push_back(frame.detail.level);
    milliseconds.push_back(1e3 * frame.seconds);
    ancestors.push_back(static_cast<double>(frame.counts.substituted) /
                        std::max<double>(1, static_cast<double>(frame.counts.triangles)));
    if (arguments.budgetMs) within += 1e3 * frame.seconds <= 1.1 * *arguments.budgetMs;
  }
  const auto mean = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  };
  Json summary = {{"frames", errors.size()},
                  {"median_prediction_error", median(errors)},
                  {"mean_level", mean(levels)},
                  {"median_ms", median(milliseconds)},
                  {"share_of_ancestors", mean(ancestors)}};
  if (arguments.budgetMs) summary["share_within_budget"] = within / static_cast<double>(errors.size());
  return summary;
}

Json runFly(const FlyArguments& arguments, const Progress& progress) {
  const scene::ScriptHead head = scene::readScriptHead(arguments.script);
  spherical::FlightOptions options{.wait = arguments.wait};
  if (arguments.budgetMs) options.budget = *arguments.budgetMs / 1e3;
  spherical::OpenFlight flight(head.model, {arguments.memoryMb << 20, arguments.gpuMb << 20}, options,
                               progress);
  const scene::Script script = flownScript(arguments.script, flight.folder().rig().origin);
  const auto finest = static_cast<double>(flight.shape().levels - 1);
  if (arguments.level && *arguments.level > finest)
    throw Error::mismatch("0.." + numberText(finest), numberText(*arguments.level)).at("--level");
  const spherical::Look look{arguments.level.value_or(finest), 0, !arguments.plane, !arguments.single};
  std::vector<spherical::FrameRecord> frames;
  const int first = script.frames->first, last = script.frames->last;
  for (int round = 0; round < arguments.rounds; ++round)
    for (int frame = first; frame <= last; ++frame) {
      progress("fly", (round + static_cast<double>(frame - first) / (last - first + 1)) / arguments.rounds);
      frames.push_back(flight.frame(cameraOf(script, frame), look, arguments.samples));
    }
  const Json summary = summaryOf(frames, arguments);
  const spherical::FrameTimes times = flight.times(frames.back().detail);
  say(fmt::format("{} frames: {:.1f} ms at the median, predicted within {:.1f} % at the median; level {:.2f} "
                  "on average",
                  summary["frames"].get<size_t>(), summary["median_ms"].get<double>(),
                  100 * summary["median_prediction_error"].get<double>(),
                  summary["mean_level"].get<double>()));
  if (arguments.budgetMs)
    say(fmt::format("{:.1f} % of the frames within {} ms + 10 %",
                    100 * summary["share_within_budget"].get<double>(), *arguments.budgetMs));
  Json report = {{"model", head.model.string()},
                 {"summary", summary},
                 {"fitted_ms",
                  {{"triangle", 1e3 * times.gpu},
                   {"upload", 1e3 * times.main},
                   {"read", 1e3 * times.disk},
                   {"setup_of_last_level", 1e3 * times.setup}}},
                 {"flight", Json::array()}};
  for (const spherical::FrameRecord& frame : frames) report["flight"].push_back(frameJson(frame));
  return report;
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect;
  bench::FlyArguments arguments;
  CLI::App app("Flies a spherical light field, at the level that a time allows", "bench_flight");
  app.add_option("script", arguments.script, "TOML: model and camera over time")->required();
  CLI::Option* budget =
      app.add_option("--budget-ms", arguments.budgetMs, "time of a frame that chooses its level")
          ->check(CLI::Range(0.1, 1e5));
  app.add_option("--level", arguments.level, "level of detail of all frames instead; default: the finest")
      ->check(CLI::Range(0.0, double(spherical::kMostLevels - 1)))
      ->excludes(budget);
  app.add_flag("--wait", arguments.wait, "wait for the images of each frame; default: show what is at hand");
  app.add_flag("--plane", arguments.plane, "project images from their planes, without their depths");
  app.add_flag("--single", arguments.single, "one pencil for each pixel, without interpolation");
  app.add_option("--rounds", arguments.rounds, "how often all frames are drawn")->check(CLI::Range(1, 1000));
  app.add_option("--warm-up", arguments.warmUp, "first frames that the summary leaves out")
      ->check(CLI::Range(0, 1'000'000));
  app.add_option("--samples", arguments.samples, "samples along each side of a pixel")
      ->check(CLI::Range(1, 8));
  app.add_option("--memory-mb", arguments.memoryMb, "images in main memory, MiB at most");
  app.add_option("--gpu-mb", arguments.gpuMb, "images on the GPU, MiB at most");
  CLI11_PARSE(app, argc, argv);
  try {
    fmt::print("{}\n", bench::runFly(arguments, {}).dump(2));
    return 0;
  } catch (const std::exception& error) {
    bench::say(std::string("bench_flight: ") + error.what());
    return 1;
  }
}
