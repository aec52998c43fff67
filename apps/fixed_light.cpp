#include "apps/fixed_light.h"

#include "apps/command.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "render/scene/scene.h"
#include "surfel/base/memory.h"
#include "surfel/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace surflect {

namespace {

// Script of the arguments: the file's, or one with the environment as its only light.
scene::Script scriptOf(const FixedLight& fixed, const Vec3<double>& origin) {
  if (!fixed.lights.empty()) {
    scene::Script script = scene::readScript(fixed.lights, origin);
    if (script.lights.empty()) throw Error("missing").at("light").in(script.path);
    if (!script.warps.empty())
      throw Error::mismatch("none, as photographs are not bent", fmt::format("{} warps", script.warps.size()))
          .at("warp")
          .in(script.path);
    return script;
  }
  scene::EnvironmentLightMotion light;
  light.image = fixed.environment;
  light.mapping = fixed.mapping;
  light.up = {fixed.up[0], fixed.up[1], fixed.up[2]};
  light.rotateDeg = 0;
  light.color = {1, 1, 1};
  light.intensity = 1;
  scene::Script script;
  script.path = fixed.environment;
  script.lights.emplace_back(std::move(light));
  return script;
}

// Prints samples of environments that were changed.
void sayChanged(const std::vector<scene::Environment>& environments) {
  for (const auto& [image, map, hash, seconds] : environments) {
    if (map->replaced > 0)
      say(fmt::format("{}: {} negative or NaN texels count as 0", image.string(), map->replaced));
    if (map->clamped > 0)
      say(fmt::format("{}: {} infinite texels count as {:.0f}", image.string(), map->clamped,
                      weights::kLargestHalf));
  }
}

} // namespace

Json relitViews(const capture::Capture& capture, const FixedLight& light, const std::filesystem::path& folder,
                const Progress& progress, const std::function<void()>& begin) {
  const Stopwatch watch;
  const scene::Script script = scriptOf(light, capture.origin);
  const std::vector<scene::Environment> environments = scene::readEnvironments(script, progress);
  sayChanged(environments);
  const std::vector<scene::ShotLight> lights =
      scene::lightsAt(script, scene::shotTime(script, light.frame), environments);
  const lightfield::RelightPlan plan = lightfield::planRelight(capture, lights, light.incomplete, progress);
  begin();
  const lightfield::RelightReport report = lightfield::relight(capture, plan, folder, progress);

  const auto training = std::ranges::count(plan.views.frames, capture::Split::train, &capture::Frame::split);
  const auto views = static_cast<std::ptrdiff_t>(plan.views.frames.size());
  const double seconds = watch.seconds();
  if (report.invalidTexels > 0)
    say(fmt::format("{} NaN or infinite texels of photographs count as 0", report.invalidTexels));
  say(fmt::format(
      "{}: {} views for training and {} for the test, each the sum of {} photograph{}{}{}; {:.1f} s",
      folder.string(), training, views - training, plan.lights.size(), plan.lights.size() == 1 ? "" : "s",
      plan.skipped.empty() ? "" : fmt::format("; {} views left out", plan.skipped.size()),
      report.resumedViews > 0 ? fmt::format("; {} were there already", report.resumedViews) : "", seconds));
  Json weights = Json::array();
  for (size_t l = 0; l < plan.lights.size(); ++l)
    weights.push_back({{"light", plan.lights[l].name},
                       {"weight", {plan.weights[l].r, plan.weights[l].g, plan.weights[l].b}}});
  return {{"training_views", training},
          {"test_views", views - training},
          {"skipped_views", plan.skipped},
          {"resumed_views", report.resumedViews},
          {"weights", weights},
          {"invalid_texels", report.invalidTexels},
          {"seconds", seconds},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

void addFixedLight(CLI::App& command, FixedLight& light, bool isRequired) {
  CLI::Option* script =
      command.add_option("--lights", light.lights, "TOML file with [[light]] as in a script")
          ->check(notEmpty())
          ->group("Light");
  CLI::Option* environment =
      command.add_option("--environment", light.environment, "environment map, instead of --lights")
          ->check(notEmpty())
          ->group("Light")
          ->excludes(script);
  if (isRequired)
    command.parse_complete_callback([&light] {
      if (!light.isGiven()) throw CLI::RequiredError("--lights or --environment");
    });
  std::vector<std::string> mappings;
  for (const auto& [name, mapping] : weights::kMappings) mappings.emplace_back(name);
  command
      .add_option_function<std::string>(
          "--mapping",
          [&light](const std::string& word) {
            light.mapping = std::ranges::find(weights::kMappings, word, [](const auto& row) {
                              return row.first;
                            })->second;
          },
          "how its pixels stand for directions; default: lat-long if twice as wide as high")
      ->check(oneOf(mappings))
      ->group("Light")
      ->needs(environment);
  command.add_option("--up", light.up, "x y z: the environment's up in the capture")
      ->capture_default_str()
      ->check(finiteIn(-1e12, 1e12))
      ->group("Light")
      ->needs(environment);
  command.add_option("--frame", light.frame, "frame at which the lights are taken")
      ->capture_default_str()
      ->check(frameNumber())
      ->group("Light")
      ->needs(script);
  CLI::Option* skip = command.add_flag_callback(
      "--skip-incomplete", [&light] { light.incomplete = lightfield::Incomplete::skipped; },
      "leave out views that lack a photograph under some light");
  skip->group("Light");
  command
      .add_flag_callback(
          "--common-lights", [&light] { light.incomplete = lightfield::Incomplete::common; },
          "use only lights under which every view has a photograph")
      ->group("Light")
      ->excludes(skip);
}

void addRelightCommand(CLI::App& app, CommandWork& work) {
  struct Arguments {
    CaptureArgument capture;
    FixedLight light;
    std::string output;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("relight", "views under other light, as sums of photographs; run again to resume");
  command->footer(
      "Example: surflect relight examples/vase --environment examples/environments/studio.exr \\\n"
      "           --up 0 0 1 --common-lights -o views/\n"
      "         surflect relight CAPTURE --lights lights.toml -o views/");
  addCaptureArgument(*command, arguments->capture);
  command->add_option("-o,--output", arguments->output, "folder of the views, a capture under fixed light")
      ->required()
      ->check(notEmpty());
  addFixedLight(*command, arguments->light, true);
  setWork(*command, work, "the same command goes on from here", [arguments](const Progress& progress) {
    return relitViews(arguments->capture.read(), arguments->light, arguments->output, progress);
  });
}

} // namespace surflect
