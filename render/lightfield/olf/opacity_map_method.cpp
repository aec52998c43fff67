#include "render/gl/context.h"
#include "render/lightfield/common/light_field_renderer.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/compression.h"
#include "render/lightfield/olf/opacity_field.h"
#include "render/lightfield/olf/opacity_map_build.h"
#include "render/lightfield/olf/opacity_map_frame.h"
#include "render/lightfield/olf/opacity_maps.h"
#include "render/lightfield/olf/opacity_method.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace surflect::olf {

namespace {

using method::row, method::words, method::wholeRange, method::Setting, method::Option;

// ---------------------------------------------------------------------------------------------------------
// Building

struct MapBuildChoice {
  MapBuildOptions options = {};
  MeshOptions mesh = {};
  std::optional<int> samples;
  lfm::Compression compression = {.means = true};
};

method::Rows<MapBuildChoice> mapBuildRows() {
  method::Rows<MapBuildChoice> rows = meshRows<MapBuildChoice>();
  rows.insert(
      rows.end(),
      {row<MapBuildChoice>(
           "samples", [](auto& o) -> auto& { return o.samples; },
           {.domain = wholeRange(2, 256),
            .help = "samples along an edge of a triangle; default: as fine as the photographs"}),
       row<MapBuildChoice>("view_size", [](auto& o) -> auto& { return o.options.viewSize; },
                           {.domain = wholeRange(lfm::kLeastViewSize, lfm::kLargestViewSize),
                            .help = "cells of a view map along each side"}),
       row<MapBuildChoice>("higher_view_size", [](auto& o) -> auto& { return o.compression.higherViewSize; },
                           {.domain = wholeRange(lfm::kLeastViewSize, lfm::kLargestViewSize),
                            .help = "cells of view maps from the second term on; default: as in the first"}),
       row<MapBuildChoice>(
           "terms", [](auto& o) -> auto& { return o.options.terms; },
           {.domain = wholeRange(0, lfm::kMostTerms), .help = "products for each vertex, at most"}),
       row<MapBuildChoice>(
           "vq", [](auto& o) -> auto& { return o.compression.ratio; },
           {.domain = method::Range{1, 1e6}, .help = "vector quantisation: maps for each stored codeword"}),
       row<MapBuildChoice>("s3tc", [](auto& o) -> auto& { return o.compression.s3tc; },
                           {.help = "store maps as S3TC (DXT1 and DXT5) blocks, which the GPU reads"})});
  return rows;
}

// Compresses finished maps, the source.
method::BuildReport compressModel(const method::BuildInput& input, const lfm::Compression& compression,
                                  const Progress& progress) {
  lfm::requireCompression(input, compression);
  const Stopwatch watch;
  const lightfield::LightFieldFolder folder(input.source, kMapFormat, kMapVersion, progress);
  OpacityMaps maps = readMaps(folder, progress);
  inFile(input.source, [&] { maps.maps = lfm::compressed(std::move(maps.maps), compression, progress); });
  method::BuildReport report;
  report.seconds["compression"] = watch.seconds();
  writeMaps(maps, folder, input.output, progress);
  lfm::addCompressed(maps.maps, input, report);
  return report;
}

method::BuildReport buildModel(const method::BuildInput& input, const Setting& setting,
                               const Progress& progress) {
  const Stopwatch watch;
  const MapBuildChoice choice = method::applied(MapBuildChoice{}, mapBuildRows(), setting);
  if (lightfield::isFinished(input.source, kMapFormat))
    return compressModel(input, choice.compression, progress);
  MapBuildOptions options = choice.options;
  lfm::requireViewSize(choice.compression, options.viewSize);
  options.mesh = {choice.mesh.hull, choice.mesh.triangles.value_or(0)};
  options.visible = choice.mesh.visible;
  options.samples = choice.samples.value_or(0);
  lightfield::Views views = lightfield::viewsOf(input, progress, true);
  MapBuildReport report;
  OpacityMaps built = buildMaps(views, options, report, progress);
  const Stopwatch compression;
  built.maps = lfm::compressed(std::move(built.maps), choice.compression, progress);
  report.seconds["compression"] = compression.seconds();
  writeMaps(built, views.capture(), input.output, progress);
  const lfm::MapBytes maps = lfm::bytesOf(built.maps);
  std::vector<double> rms;
  for (const lfm::FactorError& error : report.errors) rms.push_back(error.rms());
  const double compressed = lightfield::ratioOf(report.resampledBytes, maps.total());
  input.say(
      fmt::format("{} triangles{} of {} samples along an edge, {} vertices with {:.1f} terms on average",
                  report.triangles, report.isHull ? " of the opacity hull" : "", report.samples,
                  report.vertices, report.meanTerms));
  input.say(fmt::format("error of roots before compression: {:.2f} % with no term, {:.2f} % with all",
                        100 * rms.front(), 100 * rms.back()));
  input.say(fmt::format("{}: maps of {}, {:.0f} times smaller than the resampled light field; {:.1f} s",
                        input.output.string(), lightfield::mebibytes(maps.total()), compressed,
                        watch.seconds()));
  const auto count = [](auto number) { return static_cast<double>(number); };
  method::BuildReport result{.counts = {{"triangles", count(report.triangles)},
                                        {"vertices", count(report.vertices)},
                                        {"hull", count(report.isHull)},
                                        {"views", count(report.views)},
                                        {"samples", report.samples},
                                        {"white", report.white},
                                        {"mean_terms", report.meanTerms},
                                        {"photograph_bytes", count(lightfield::pictureBytes(views))},
                                        {"resampled_bytes", count(report.resampledBytes)},
                                        {"compression", compressed},
                                        {"bytes", count(method::modelBytes(input.output))}},
                             .lists = {{"rms", rms}},
                             .seconds = report.seconds};
  lfm::addMapBytes(maps, result);
  return result;
}

// ---------------------------------------------------------------------------------------------------------
// Rendering

struct MapRenderOptions {
  int samples = lightfield::kSamples;
  MapFrameOptions frame = {};
};

const method::Rows<MapRenderOptions>& mapRenderRows() {
  const std::pair<std::string, std::vector<method::Value>> peeling{"order", {"peel"}};
  static const method::Rows<MapRenderOptions> kRows{
      lightfield::samplesRow<MapRenderOptions>(),
      row<MapRenderOptions>("order", [](auto& o) -> auto& { return o.frame.order; },
                            {.domain = words({"list", "peel"}),
                             .paper = "peel",
                             .help = "order of depths: a list for each pixel, or depth peeling"}),
      row<MapRenderOptions>("terms", [](auto& o) -> auto& { return o.frame.terms; },
                            {.domain = wholeRange(0, lfm::kMostTerms),
                             .help = "approximation terms that are added to the mean"}),
      row<MapRenderOptions>("passes", [](auto& o) -> auto& { return o.frame.passes; },
                            {.domain = words({"single", "per_term"}),
                             .paper = "per_term",
                             .help = "one pass of a layer for all terms, or one for each",
                             .needs = peeling}),
      row<MapRenderOptions>("layers", [](auto& o) -> auto& { return o.frame.layers; },
                            {.domain = wholeRange(1, kMostLayers),
                             .help = "nearest layers of depth that are drawn, at most",
                             .needs = peeling})};
  return kRows;
}

// Open maps and their frames, which belong to the context's thread.
struct OpenOpacityMaps {
  lightfield::LightFieldFolder folder;
  std::shared_ptr<const gl::Context> context;
  OpacityMapFrame frame;
  size_t terms = 0; // of the maps
  MapRenderOptions options = {};

  void draw(const capture::Camera<AcquisitionSpace>& camera, const std::vector<std::string>&,
            const Progress& progress, method::FrameLayers& layers) {
    FrameCounts counts;
    layers.color = frame.render(lightfield::sampled(camera, options.samples), options.frame,
                                layers.report.seconds, counts, options.samples, progress);
    const auto count = [](size_t number) { return static_cast<double>(number); };
    layers.report.counts = {
        {"work.texels", count(counts.fragments) * count(1 + options.frame.terms.value_or(terms))},
        {"work.pixels", lightfield::samplesOf(camera, options.samples)},
        {"passes", count(counts.passes)},
        {"layers", count(counts.layers)},
        {"fragments", count(counts.fragments)},
        {"texture_bytes", count(frame.drawing().maps().bytes())}};
  }
};

std::vector<Option> rowsOf(size_t terms, bool isPeeled) {
  std::vector<Option> rows = method::optionsOf(mapRenderRows());
  for (Option& option : rows) {
    if (option.name == "terms") {
      option.domain = wholeRange(0, static_cast<double>(terms));
      option.standard = terms;
      for (size_t k = terms + 1; k-- > 0;) option.sweep.emplace_back(k);
    }
    if (option.name == "layers" && isPeeled) option.sweep = {kMostLayers, 8, 4, 3, 2, 1};
  }
  return rows;
}

std::unique_ptr<method::Renderer> openMaps(const std::filesystem::path& path, const Setting& setting,
                                           const Progress& progress) {
  auto context = gl::contextOfThread();
  lightfield::LightFieldFolder folder(path, kMapFormat, kMapVersion, progress);
  const OpacityMaps maps = readMaps(folder, progress);
  const size_t terms = maps.maps.terms.size();
  OpacityMapFrame frame(maps, context->describe().limits);
  const auto open = std::make_shared<OpenOpacityMaps>(
      OpenOpacityMaps{std::move(folder), std::move(context), std::move(frame), terms});
  const auto& positions = open->folder.mesh().positions;
  const bool isPeeled = setting.contains("order") && setting.at("order") == method::Value("peel");
  lightfield::LightFieldRenderer::Parts parts =
      lightfield::partsOf(open, mapRenderRows(),
                          {.method = olfmMethod().tag,
                           .folder = path,
                           .identity = fmt::format("opacity light field maps {} {}",
                                                   hex(open->folder.identity()), open->context->driver()),
                           .counts = {{"terms", terms},
                                      {"triangles", maps.maps.mesh.triangles.size()},
                                      {"map_bytes", lfm::bytesOf(maps.maps).total()},
                                      {"texture_bytes", open->frame.drawing().maps().bytes()},
                                      {"auxiliary_bytes", open->frame.drawing().mesh().bytes()}},
                           .rig = open->folder.rig(),
                           .middle = middleOf(positions),
                           .points = positions});
  parts.options = rowsOf(terms, isPeeled);
  return std::make_unique<lightfield::LightFieldRenderer>(std::move(parts), setting);
}

} // namespace

const method::Method& olfmMethod() {
  static const method::Method kMethod{.tag = "olfm",
                                      .title =
                                          "opacity light field maps: light field maps of colour and alpha",
                                      .paper = "Vlasic et al. 2003, §6",
                                      .format = kMapFormat,
                                      .buildOptions = method::optionsOf(mapBuildRows()),
                                      .renderOptions = method::optionsOf(mapRenderRows()),
                                      .compressOptions = {"higher_view_size", "vq", "s3tc"},
                                      .build = buildModel,
                                      .open = openMaps};
  return kMethod;
}

} // namespace surflect::olf
