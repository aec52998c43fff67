#include "apps/capture_argument.h"
#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/lightfield/common/relight.h"
#include "render/scene/scene.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/stopwatch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

namespace surflect {

namespace {

struct RelightArguments {
  CaptureArgument capture;
  std::string lights, environment, output;
  std::array<double, 3> up = {0, 1, 0};
  double frame = 1;
  lightfield::Incomplete incomplete = lightfield::Incomplete::refused;
};

// Script of the arguments: the file's, or one with the environment as its only light.
scene::Script scriptOf(const RelightArguments& arguments, const Vec3<double>& origin) {
  if (!arguments.lights.empty()) {
    scene::Script script = scene::readScript(arguments.lights, origin);
    if (script.lights.empty()) throw Error("missing").at("light").in(script.path);
    if (!script.warps.empty())
      throw Error::mismatch("none, as photographs are not bent", fmt::format("{} warps", script.warps.size()))
          .at("warp")
          .in(script.path);
    return script;
  }
  scene::EnvironmentLightMotion light;
  light.image = arguments.environment;
  light.up = {arguments.up[0], arguments.up[1], arguments.up[2]};
  light.rotateDeg = 0;
  light.color = {1, 1, 1};
  light.intensity = 1;
  scene::Script script;
  script.path = arguments.environment;
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
                      ulr::kLargestHalf));
  }
}

Json runRelight(const RelightArguments& arguments, const Progress& progress) {
  const Stopwatch watch;
  const capture::Capture capture = arguments.capture.read();
  const scene::Script script = scriptOf(arguments, capture.origin);
  const std::vector<scene::Environment> environments = scene::readEnvironments(script, progress);
  sayChanged(environments);
  const std::vector<scene::ShotLight> lights =
      scene::lightsAt(script, scene::shotTime(script, arguments.frame), environments);
  const lightfield::RelightPlan plan =
      lightfield::planRelight(capture, lights, arguments.incomplete, progress);
  const lightfield::RelightReport report = lightfield::relight(capture, plan, arguments.output, progress);

  const auto training = std::ranges::count(plan.views.frames, capture::Split::train, &capture::Frame::split);
  const auto views = static_cast<std::ptrdiff_t>(plan.views.frames.size());
  const double seconds = watch.seconds();
  if (report.invalidTexels > 0)
    say(fmt::format("{} NaN or infinite texels of photographs count as 0", report.invalidTexels));
  say(fmt::format(
      "{}: {} views for training and {} for the test, each the sum of {} photograph{}{}{}; {:.1f} s",
      arguments.output, training, views - training, plan.lights.size(), plan.lights.size() == 1 ? "" : "s",
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

} // namespace

void addRelightCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<RelightArguments>();
  CLI::App* command =
      app.add_subcommand("relight", "views under other light, as sums of photographs; run again to resume");
  command->footer(
      "Example: surflect relight examples/vase --environment examples/environments/studio.exr \\\n"
      "           --up 0 0 1 --common-lights -o views/\n"
      "         surflect relight CAPTURE --lights lights.toml -o views/");
  addCaptureArgument(*command, arguments->capture);
  CLI::Option_group* light = command->add_option_group("Light", "one of them");
  CLI::Option* script =
      light->add_option("--lights", arguments->lights, "TOML file with [[light]] as in a script");
  CLI::Option* environment =
      light->add_option("--environment", arguments->environment, "environment map, lat-long or angular")
          ->check(notEmpty());
  light->require_option(1);
  command->add_option("--up", arguments->up, "x y z: the environment's up in the capture")
      ->capture_default_str()
      ->check(finiteIn(-1e12, 1e12))
      ->needs(environment);
  command->add_option("--frame", arguments->frame, "of the file of lights")
      ->capture_default_str()
      ->check(frameNumber())
      ->needs(script);
  command->add_option("-o,--output", arguments->output, "folder of the views, a capture under fixed light")
      ->required()
      ->check(notEmpty());
  CLI::Option* skip = command->add_flag_callback(
      "--skip-incomplete", [arguments] { arguments->incomplete = lightfield::Incomplete::skipped; },
      "leave out views that lack a photograph under some light");
  command
      ->add_flag_callback(
          "--common-lights", [arguments] { arguments->incomplete = lightfield::Incomplete::common; },
          "use only lights under which every view has a photograph")
      ->excludes(skip);
  setWork(*command, work, "the same command goes on from here",
          [arguments](const Progress& progress) { return runRelight(*arguments, progress); });
}

} // namespace surflect
