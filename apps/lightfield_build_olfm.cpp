#include "apps/lightfield_build.h"
#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/lightfield/lfm/codebook_maps.h"
#include "render/lightfield/lfm/tile.h"
#include "render/lightfield/olf/opacity_map_build.h"
#include "render/lightfield/olf/opacity_map_file.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/stopwatch.h"

#include <fmt/format.h>

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace surflect {

namespace {

struct OlfmArguments {
  BuildArguments common;
  olf::MapBuildOptions options;
  double codebookRatio = 0; // 0: no codebooks
  bool s3tc = false;
};

Json runOlfm(const OlfmArguments& arguments, const Progress& progress) {
  const Stopwatch watch;
  lightfield::Views views = arguments.common.read(progress, true);
  sayNotes(views);
  olf::MapBuildReport report;
  olf::OpacityMaps built = olf::buildMaps(views, arguments.options, report, progress);
  const Stopwatch compression;
  if (arguments.codebookRatio > 0)
    built.maps = lfm::withCodebooks(built.maps, {.ratio = arguments.codebookRatio, .means = true}, progress);
  if (arguments.s3tc) built.maps = lfm::encoded(std::move(built.maps));
  report.seconds["compression"] = compression.seconds();
  olf::writeMaps(built, views.capture(), arguments.common.output, progress);
  const lfm::MapBytes maps = lfm::bytesOf(built.maps);
  std::vector<double> rms;
  for (const lfm::FactorError& error : report.errors) rms.push_back(error.rms());
  const double compressed = ratioOf(report.resampledBytes, maps.total());
  say(fmt::format("{} triangles{} of {} samples along an edge, {} vertices with {:.1f} terms on average",
                  report.triangles, report.isHull ? " of the opacity hull" : "", report.samples,
                  report.vertices, report.meanTerms));
  say(fmt::format("error of roots before compression: {:.2f} % with no term, {:.2f} % with all",
                  100 * rms.front(), 100 * rms.back()));
  say(fmt::format("{}: maps of {}, {:.0f} times smaller than the resampled light field; {:.1f} s",
                  arguments.common.output, mebibytes(maps.total()), compressed, watch.seconds()));
  return {{"format", "olfm"},
          {"triangles", report.triangles},
          {"vertices", report.vertices},
          {"hull", report.isHull},
          {"views", report.views},
          {"samples", report.samples},
          {"white", report.white},
          {"mean_terms", report.meanTerms},
          {"rms", rms},
          {"photograph_bytes", pictureBytes(views)},
          {"resampled_bytes", report.resampledBytes},
          {"map_bytes", mapBytesJson(maps)},
          {"compression", compressed},
          {"bytes", bytesIn(arguments.common.output)},
          {"seconds", report.seconds},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

} // namespace

void addOpacityLightFieldMaps(CLI::App& build, CommandWork& work) {
  auto arguments = std::make_shared<OlfmArguments>();
  olf::MapBuildOptions& options = arguments->options;
  CLI::App* command =
      build.add_subcommand("olfm", "opacity light field maps: light field maps of colour and alpha");
  command->footer(
      "Example: surflect lightfield build olfm views/ -o fur.olfm --hull --triangles 3000 --vq 8 --s3tc");
  addBuildArguments(*command, arguments->common);
  addCoarseMesh(*command, options.mesh.hull, options.mesh.triangles);
  addMapSizes(*command, options.samples, options.viewSize);
  command->add_option("--terms", options.terms, "products for each vertex, at most")
      ->capture_default_str()
      ->check(CLI::Range(size_t{0}, lfm::kMostTerms));
  addVisible(*command, options.visible);
  command
      ->add_option("--order", options.order,
                   "order of depths: list of each pixel (default), or depth peeling")
      ->option_text("list or peel")
      ->transform(CLI::Transformer(
          std::map<std::string, olf::Order>{{"list", olf::Order::list}, {"peel", olf::Order::peel}}));
  command
      ->add_option("--vq", arguments->codebookRatio,
                   "vector quantisation: so many maps for each that is stored")
      ->check(finiteIn(1, 1e6));
  command->add_flag("--s3tc", arguments->s3tc,
                    "store maps as S3TC (DXT1 and DXT5) blocks, which the GPU reads");
  setWork(*command, work, "run it again to build from the start",
          [arguments](const Progress& progress) { return runOlfm(*arguments, progress); });
}

} // namespace surflect
