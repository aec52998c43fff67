#include "apps/lightfield_build.h"

#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/lightfield/olf/build.h"
#include "render/lightfield/olf/opacity_file.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/stopwatch.h"

#include <fmt/format.h>

#include <map>
#include <memory>
#include <string>

namespace surflect {

namespace {

struct OpacityArguments {
  BuildArguments common;
  olf::BuildOptions options;
  size_t budgetMebibytes = 1024;
};

Json runOpacity(OpacityArguments& arguments, const char* name, const Progress& progress) {
  const Stopwatch watch;
  arguments.options.budget = arguments.budgetMebibytes << 20;
  lightfield::Views views = arguments.common.read(progress, true);
  sayNotes(views);
  const olf::BuildReport report = olf::build(views, arguments.options, arguments.common.output, progress);
  if (report.unseenVertices > 0)
    say(fmt::format("{} of {} vertices are seen by no view: they blend the views that face them",
                    report.unseenVertices, report.vertices));
  if (report.scale < 1)
    say(fmt::format("views are scaled to {:.0f} % of their width to stay within --budget",
                    100 * report.scale));
  say(fmt::format("{}: {} triangles{}, {} views of {} x {} texels, {:.0f} for each vertex, {}; {:.1f} s",
                  arguments.common.output, report.triangles, report.isHull ? " of the opacity hull" : "",
                  report.views, report.width, report.height, report.visibleViews, mebibytes(report.bytes),
                  watch.seconds()));
  return {{"format", name},
          {"triangles", report.triangles},
          {"vertices", report.vertices},
          {"hull", report.isHull},
          {"views", report.views},
          {"unseen_vertices", report.unseenVertices},
          {"visible_views", report.visibleViews},
          {"view_size", {report.width, report.height}},
          {"scale", report.scale},
          {"picture_bytes", report.pictureBytes},
          {"packed_bytes", report.packedBytes},
          {"bytes", report.bytes},
          {"seconds", report.seconds},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

void addOpacity(CLI::App& build, CommandWork& work, const char* name, const char* purpose,
                olf::Method method) {
  auto arguments = std::make_shared<OpacityArguments>();
  olf::BuildOptions& options = arguments->options;
  options.method = method;
  CLI::App* command = build.add_subcommand(name, purpose);
  command->footer(
      fmt::format("Example: surflect lightfield build {0} views/ -o fur.{0} --hull --triangles 3000", name));
  addBuildArguments(*command, arguments->common);
  addCoarseMesh(*command, options.hull, options.triangles);
  if (method == olf::Method::vdtm)
    command
        ->add_option("--domain", options.domain,
                     "triangulate directions on the sphere (default), or projected onto the tangent plane")
        ->option_text("sphere or plane")
        ->transform(CLI::Transformer(std::map<std::string, olf::Domain>{{"sphere", olf::Domain::sphere},
                                                                        {"plane", olf::Domain::plane}}));
  addVisible(*command, options.visible);
  command
      ->add_option("--order", options.order,
                   "order of depths: list of each pixel (default), depth peeling, or BSP tree")
      ->option_text("list, peel or bsp")
      ->transform(CLI::Transformer(std::map<std::string, olf::Order>{
          {"list", olf::Order::list}, {"peel", olf::Order::peel}, {"bsp", olf::Order::bsp}}));
  command->add_option("--bsp-trees", options.bspTrees, "random insertions of which the smallest tree is used")
      ->capture_default_str()
      ->check(CLI::Range(size_t{1}, olf::kMostTrees));
  command->add_option("--budget", arguments->budgetMebibytes, "MiB of the views; larger ones are scaled down")
      ->capture_default_str()
      ->check(CLI::Range(size_t{1}, size_t{1} << 20));
  setWork(*command, work, "run it again to build from the start",
          [arguments, name](const Progress& progress) { return runOpacity(*arguments, name, progress); });
}

} // namespace

void addOpacityLightFields(CLI::App& build, CommandWork& work) {
  addOpacity(build, work, "vdtm", "opacity light field by view-dependent texture mapping", olf::Method::vdtm);
  addOpacity(build, work, "ulr", "opacity light field by unstructured lumigraph rendering", olf::Method::ulr);
}

} // namespace surflect
