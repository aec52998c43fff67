#include "apps/method_options.h"
#include "apps/pack_report.h"
#include "apps/terminal.h"
#include "render/scene/scene.h"
#include "render/stage/stage_pictures.h"
#include "render/stage/stage_scene.h"
#include "render/surfels/surfel_method.h"
#include "surfel/base/file.h"
#include "surfel/base/memory.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <string>
#include <vector>

namespace surflect {

namespace {

struct CaptureArguments {
  std::string stage, output, model, scale, script, mesh;
  double frame = 1;
  MethodOptions pack; // of the store
};

Json capturePictures(const stage::Stage& stage, const CaptureArguments& arguments, const Progress& progress) {
  const Stopwatch watch;
  stage::StageReport report;
  if (!arguments.script.empty()) {
    const scene::Script script = scene::readScript(arguments.script);
    const warp::WarpPointer warp = scene::warpAt(script, scene::shotTime(script, arguments.frame));
    const std::array both = {script.hash, std::bit_cast<uint64_t>(arguments.frame)};
    const stage::StageDeformation deformation{*warp, contentHash(std::as_bytes(std::span(both)))};
    report =
        stage::captureStage(stage, &deformation, stage::StageFrames::deformed, arguments.output, progress);
  } else {
    const stage::StageFrames which =
        arguments.model.empty() ? stage::StageFrames::all : stage::StageFrames::test;
    report = stage::captureStage(stage, nullptr, which, arguments.output, progress);
  }
  const double seconds = watch.seconds();
  say(fmt::format("{}: {} views under {} lights, {} frames for training and {} for the test{}; {:.1f} s",
                  arguments.output, report.views, report.lights, report.trainingFrames, report.testFrames,
                  report.resumedViews > 0 ? fmt::format("; {} views were there already", report.resumedViews)
                                          : "",
                  seconds));
  return {{"views", report.views},
          {"lights", report.lights},
          {"training_frames", report.trainingFrames},
          {"test_frames", report.testFrames},
          {"resumed_views", report.resumedViews},
          {"samples", stage.trace.samples},
          {"seconds", seconds},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

// Prints the estimated size. Pictures that are traced meanwhile are reported by the progress.
void announceSize(const model::PackEstimate& estimate) {
  say(fmt::format("about {:.1f} MB on disk, {:.0f} MB of memory; {} surfels",
                  static_cast<double>(estimate.diskBytes) / 1e6,
                  static_cast<double>(estimate.memoryBytes) / 1e6, estimate.surfels));
}

// Warns of cameras that see an object from within.
void sayCamerasInside(const stage::Stage& stage) {
  const stage::StageScene scene(stage.objects);
  std::vector<std::string> inside;
  for (const capture::View& view : stage.rig.views)
    if (view.camera.lens.model != capture::Lens::Model::orthographic &&
        stage::isInside(scene, assume<Point3<AcquisitionSpace, double>>(view.camera.center().raw())))
      inside.push_back(view.identity);
  if (!inside.empty())
    say(fmt::format("warning: {} of {} are inside an object: {}", inside.size(),
                    counted(stage.rig.views.size(), "camera"), firstNames(inside)));
}

Json runCapture(const CaptureArguments& arguments, const Progress& progress) {
  progress("shapes", 0);
  const stage::Stage stage = stage::readStage(arguments.stage, arguments.scale);
  const auto isClear = [](const stage::StageObject& object) { return material::isSpecular(object.material); };
  if (stage.trace.lightRadius.radians() == 0 && std::ranges::any_of(stage.objects, isClear))
    say("mirrors and clear glass show nothing of lights without extent: lights.radius_deg gives them one");
  sayCamerasInside(stage);
  if (arguments.model.empty()) return capturePictures(stage, arguments, progress);
  if (!arguments.output.empty())
    stage::requireCapturable(stage, nullptr, stage::StageFrames::test, arguments.output);
  model::PackOptions pack = surfels::packOptions(arguments.pack.settingFor(surfels::surfelMethod()));
  pack.impostor.mesh = arguments.mesh;
  const model::PackReport report = stage::packStage(stage, arguments.model, pack, progress, announceSize);
  announce(report, arguments.model);
  Json json = {{"model", jsonOf(report)}};
  json["model"]["samples"] = stage.trace.samples;
  if (!arguments.output.empty()) json["test"] = capturePictures(stage, arguments, progress);
  return json;
}

} // namespace

void addCaptureCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<CaptureArguments>();
  CLI::App* command = app.add_subcommand("capture", "photograph a virtual light stage; run again to resume");
  command->footer("Example: surflect capture examples/stages/sphere.toml -o sphere\n"
                  "         surflect capture examples/stages/sphere.toml --pack sphere.srf -o test");
  command->add_option("stage", arguments->stage, "TOML file: objects, cameras and lights")->required();
  CLI::Option_group* results = command->add_option_group("Results", "one of them, or both");
  results
      ->add_option("-o,--output", arguments->output,
                   "the capture's folder; with --pack it has what is kept for the test")
      ->check(notEmpty());
  CLI::Option* model = results
                           ->add_option("--pack", arguments->model,
                                        "the folder of a model, packed view by view as they are traced")
                           ->check(notEmpty());
  results->require_option(1, 2);
  command->add_option("--scale", arguments->scale, "a [scale.NAME] of the stage file, such as tiny");
  CLI::Option* script = command
                            ->add_option("--script", arguments->script,
                                         "warps to bend the objects by: the truth for evaluate --script")
                            ->excludes(model);
  command->add_option("--frame", arguments->frame, "frame of the script")
      ->capture_default_str()
      ->check(frameNumber())
      ->needs(script);
  constexpr std::string_view kStored[] = {"tolerance", "surfels", "opaque", "tables", "overwrite"};
  for (CLI::Option* option : arguments->pack.add(*command, surfels::surfelMethod(), kStored))
    option->needs(model);
  command->add_option("--mesh", arguments->mesh, "impostor geometry instead of the stage's own")
      ->needs(model);
  setWork(*command, work, "the same command again goes on from here",
          [arguments](const Progress& progress) { return runCapture(*arguments, progress); });
}

} // namespace surflect
