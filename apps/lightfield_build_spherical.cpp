#include "apps/lightfield_build.h"

#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/spherical/build.h"
#include "render/lightfield/traced/traced_images.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/stopwatch.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <set>
#include <string>

namespace surflect {

namespace {

struct SphericalArguments {
  BuildArguments common;
  spherical::BuildOptions options;
  lightfield::RayBlend rays;
  std::string scale; // of a stage

  bool isOfStage() const { return std::filesystem::path(common.views.path).extension() == ".toml"; }
};

spherical::BuildReport buildFrom(const SphericalArguments& arguments, const Progress& progress) {
  const BuildArguments& common = arguments.common;
  if (arguments.isOfStage()) {
    requireCreatable(common.output);
    lightfield::requireLightFieldFolder(common.output);
    const stage::Stage stage = stage::readStage(common.views.path, arguments.scale);
    return traced::build(stage, arguments.options, common.output, progress);
  }
  const lightfield::Views views = common.read(progress);
  sayNotes(views);
  return spherical::build(views, arguments.options, arguments.rays, common.output, progress);
}

Json runSpherical(const SphericalArguments& arguments, const Progress& progress) {
  const Stopwatch watch;
  const spherical::BuildReport report = buildFrom(arguments, progress);
  const double onObject = static_cast<double>(report.seen + report.unseen);
  if (report.unseen > 0)
    say(fmt::format("{:.1f} % of the texels on the object are seen by no photograph: filled from around",
                    100 * static_cast<double>(report.unseen) / onObject));
  say(fmt::format("{}: {} images of {} x {} in {} levels, {}; {:.1f} s", arguments.common.output,
                  report.shape.images(), report.shape.size, report.shape.size, report.shape.levels,
                  mebibytes(report.bytes), watch.seconds()));
  return {{"format", "spherical"},
          {"levels", report.shape.levels},
          {"images", report.shape.images()},
          {"size", report.shape.size},
          {"radius", report.shape.sphere.radius},
          {"texels_seen", report.seen},
          {"texels_unseen", report.unseen},
          {"level_bytes", report.levelBytes},
          {"image_memory_bytes", spherical::imageBytes(report.shape.size)},
          {"bytes", report.bytes},
          {"seconds", report.seconds},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

} // namespace

void addSphericalLightField(CLI::App& build, CommandWork& work) {
  auto arguments = std::make_shared<SphericalArguments>();
  spherical::BuildOptions& options = arguments->options;
  CLI::App* command = build.add_subcommand(
      "spherical", "spherical light field: parallel projections along evenly spread directions");
  command->footer("Example: surflect lightfield build spherical views/ -o vase.sph --levels 4 --size 256\n"
                  "         surflect lightfield build spherical examples/stages/idol.toml -o idol.sph");
  addBuildArguments(*command, arguments->common);
  command
      ->add_option("--levels", options.levels,
                   "levels of detail: 20 images in one level, four times as many with each further one")
      ->capture_default_str()
      ->check(CLI::Range(size_t{1}, spherical::kMostLevels));
  command->add_option("--size", options.size, "texels along each side of an image")
      ->capture_default_str()
      ->check(CLI::IsMember(std::set<int>{8, 16, 32, 64, 128, 256, 512, 1024}));
  CLI::Option* nearest = command->add_flag("--nearest", arguments->rays.nearest,
                                           "take the nearest view for each ray, do not blend");
  CLI::Option* scale =
      command->add_option("--scale", arguments->scale, "a [scale.NAME] of a stage file, such as tiny");
  command->parse_complete_callback([=] {
    if (arguments->isOfStage() && (nearest->count() > 0 || !arguments->common.mesh.empty()))
      throw CLI::ValidationError(
          "--nearest and --mesh are for photographs, which a stage file does not have");
    if (!arguments->isOfStage() && scale->count() > 0)
      throw CLI::ValidationError("--scale is for a stage file, FILE.toml");
  });
  setWork(*command, work, "run it again to build from the start",
          [arguments](const Progress& progress) { return runSpherical(*arguments, progress); });
}

} // namespace surflect
