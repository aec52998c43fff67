#include "apps/lightfield_build.h"

#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/lightfield/spherical/build.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/stopwatch.h"

#include <fmt/format.h>

#include <memory>
#include <set>

namespace surflect {

namespace {

struct SphericalArguments {
  BuildArguments common;
  spherical::BuildOptions options;
};

Json runSpherical(const SphericalArguments& arguments, const Progress& progress) {
  const Stopwatch watch;
  const lightfield::Views views = arguments.common.read(progress);
  sayNotes(views);
  const spherical::BuildReport report =
      spherical::build(views, arguments.options, arguments.common.output, progress);
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
  command->footer("Example: surflect lightfield build spherical views/ -o vase.sph --levels 4 --size 256");
  addBuildArguments(*command, arguments->common);
  command
      ->add_option("--levels", options.levels,
                   "levels of detail: 20 images in one level, four times as many with each further one")
      ->capture_default_str()
      ->check(CLI::Range(size_t{1}, spherical::kMostLevels));
  command->add_option("--size", options.size, "texels along each side of an image")
      ->capture_default_str()
      ->check(CLI::IsMember(std::set<int>{8, 16, 32, 64, 128, 256, 512, 1024}));
  command->add_flag("--nearest", options.rays.nearest, "take the nearest view for each ray, do not blend");
  setWork(*command, work, "run it again to build from the start",
          [arguments](const Progress& progress) { return runSpherical(*arguments, progress); });
}

} // namespace surflect
