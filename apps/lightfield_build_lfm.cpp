#include "apps/lightfield_build.h"
#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/lightfield/lfm/build.h"
#include "render/lightfield/lfm/codebook_maps.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/resolution.h"
#include "render/lightfield/lfm/tile.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/stopwatch.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace surflect {

namespace {

struct LfmArguments {
  BuildArguments common;
  size_t triangles = 0;
  lfm::BuildOptions options{.samples = 0};
  std::optional<size_t> terms;
  lfm::MapCodebookOptions codebooks{.ratio = 0};
  double codebookError = 0; // RMS
  bool s3tc = false;
};

constexpr size_t kTermsWithTolerance = 16;

Json runLfm(const LfmArguments& arguments, const Progress& progress) {
  const Stopwatch watch;
  const std::filesystem::path output = arguments.common.output;
  lightfield::Views views = arguments.common.read(progress);
  sayNotes(views);
  lfm::BuildOptions options = arguments.options;
  options.terms = arguments.terms.value_or(options.tolerance > 0 ? kTermsWithTolerance : options.terms);
  lfm::Resolution resolution = lfm::resolutionFor(views, arguments.triangles, options.samples);
  options.samples = resolution.samples;
  views.replaceMesh(std::move(resolution.mesh), progress);
  lfm::BuildReport report;
  lfm::LightFieldMaps built = lfm::build(views, options, report, progress);
  Stopwatch compression;
  lfm::MapCodebookOptions codebooks = arguments.codebooks;
  codebooks.distortion = arguments.codebookError * arguments.codebookError;
  if (codebooks.ratio > 0 || codebooks.distortion > 0) built = lfm::withCodebooks(built, codebooks, progress);
  if (arguments.s3tc) built = lfm::encoded(std::move(built));
  report.seconds["compression"] = compression.seconds();
  lfm::writeMaps(built, views.capture(), output, progress);
  const lfm::MapBytes maps = lfm::bytesOf(built);
  const std::vector<double> rms = lfm::relativeErrors(report);
  const uint64_t photographBytes = pictureBytes(views);
  const double unseen =
      static_cast<double>(report.unseenRows) / static_cast<double>(std::max<size_t>(1, report.rows));
  say(fmt::format("{} triangles of {} samples along an edge, {} vertices with {:.1f} terms on average",
                  built.mesh.triangles.size(), options.samples, report.vertices, report.meanTerms));
  if (unseen > 0)
    say(fmt::format("{:.1f} % of the surface and {} vertices are seen by no photograph: filled from around",
                    100 * unseen, report.unseenVertices));
  say(fmt::format(
      "error of square roots before compression: {:.2f} % of white's with no term, {:.2f} % with all",
      100 * rms.front(), 100 * rms.back()));
  say(fmt::format(
      "{}: maps of {}, {:.0f} times smaller than the resampled light field; the photographs' files "
      "take {}; {:.1f} s",
      arguments.common.output, mebibytes(maps.total()), ratioOf(report.resampledBytes, maps.total()),
      mebibytes(photographBytes), watch.seconds()));
  return {{"format", "lfm"},
          {"photographs", report.photographs},
          {"triangles", built.mesh.triangles.size()},
          {"vertices", report.vertices},
          {"samples", options.samples},
          {"white", report.white},
          {"mean_terms", report.meanTerms},
          {"rms", rms},
          {"unseen_share", unseen},
          {"unseen_vertices", report.unseenVertices},
          {"photograph_bytes", photographBytes},
          {"normalized_bytes", report.normalizedBytes},
          {"resampled_bytes", report.resampledBytes},
          {"map_bytes", mapBytesJson(maps)},
          {"compression", ratioOf(report.resampledBytes, maps.total())},
          {"bytes", bytesIn(output)},
          {"seconds", report.seconds},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

} // namespace

void addLightFieldMaps(CLI::App& build, CommandWork& work) {
  auto arguments = std::make_shared<LfmArguments>();
  lfm::BuildOptions& options = arguments->options;
  CLI::App* command = build.add_subcommand("lfm", "light field maps: products of surface maps and view maps");
  command->footer("Example: surflect lightfield build lfm views/ -o vase.lfm --terms 3 --vq 8 --s3tc");
  addBuildArguments(*command, arguments->common);
  command
      ->add_option("--triangles", arguments->triangles,
                   "simplify the mesh to so many; default: 300 pixels of a photograph for each")
      ->check(CLI::Range(size_t{4}, size_t{1} << 31));
  addMapSizes(*command, options.samples, options.viewSize);
  command
      ->add_option("--terms", arguments->terms,
                   "products for each vertex, at most; default: 3, or 16 with --tolerance")
      ->check(CLI::Range(size_t{0}, lfm::kMostTerms));
  command
      ->add_option("--tolerance", options.tolerance,
                   "no more terms than this RMS error of square roots takes, relative to that of white")
      ->check(finiteIn(1e-6, 1));
  command
      ->add_option("--method", options.method,
                   "pca: a mean and signed maps, the strongest first; nmf: maps without negative values")
      ->option_text("pca or nmf")
      ->transform(CLI::Transformer(
          std::map<std::string, lfm::Method>{{"pca", lfm::Method::pca}, {"nmf", lfm::Method::nmf}}));
  command
      ->add_option("--visible", options.visible,
                   "photographs of a surface sample: those that see it, or that see its whole triangle")
      ->option_text("sample or triangle")
      ->transform(CLI::Transformer(std::map<std::string, lfm::Visible>{
          {"sample", lfm::Visible::sample}, {"triangle", lfm::Visible::triangle}}));
  CLI::Option* ratio = command
                           ->add_option("--vq", arguments->codebooks.ratio,
                                        "vector quantisation: so many maps for each that is stored")
                           ->check(finiteIn(1, 1e6));
  CLI::Option* error =
      command
          ->add_option("--vq-error", arguments->codebookError,
                       "vector quantisation: as few maps as this RMS error of values within -1..1 allows")
          ->check(finiteIn(1e-6, 1))
          ->excludes(ratio);
  CLI::Option* start =
      command
          ->add_option("--vq-start", arguments->codebooks.start,
                       "first codebook: split from one map, or merged from pairs of near maps")
          ->option_text("split or pairs")
          ->transform(CLI::Transformer(std::map<std::string, lfm::CodebookStart>{
              {"split", lfm::CodebookStart::split},
              {"pairs", lfm::CodebookStart::pairwiseNearestNeighbors}}));
  command->parse_complete_callback([=] {
    if (start->count() > 0 && ratio->count() + error->count() == 0)
      throw CLI::RequiresError("--vq-start", "--vq or --vq-error");
  });
  command->add_flag("--s3tc", arguments->s3tc, "store maps as S3TC (DXT1) blocks, which the GPU reads");
  setWork(*command, work, "run it again to build from the start",
          [arguments](const Progress& progress) { return runLfm(*arguments, progress); });
}

} // namespace surflect
