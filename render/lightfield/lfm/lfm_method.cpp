#include "render/lightfield/lfm/lfm_method.h"

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_renderer.h"
#include "render/lightfield/common/photographs.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/build.h"
#include "render/lightfield/lfm/compression.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/lfm_frame.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/vertex_matrix.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory.h"
#include "surfel/base/time.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace surflect::lfm {

namespace {

using method::row, method::words, method::wholeRange, method::Setting, method::Option;

// ---------------------------------------------------------------------------------------------------------
// Building

struct BuildChoice {
  std::optional<size_t> triangles, terms;
  std::optional<int> samples;
  BuildOptions options = {};
  Compression compression = {};
};

constexpr size_t kTermsWithTolerance = 16;

const method::Rows<BuildChoice>& buildRows() {
  static const method::Rows<BuildChoice> kRows{
      row<BuildChoice>(
          "triangles", [](auto& o) -> auto& { return o.triangles; },
          {.domain = wholeRange(4, 2147483648),
           .help = "simplify the mesh to so many; default: 300 pixels of a photograph for each"}),
      row<BuildChoice>("samples", [](auto& o) -> auto& { return o.samples; },
                       {.domain = wholeRange(2, 256),
                        .help = "samples along an edge of a triangle; default: as fine as the photographs"}),
      row<BuildChoice>("view_size", [](auto& o) -> auto& { return o.options.viewSize; },
                       {.domain = wholeRange(kLeastViewSize, kLargestViewSize),
                        .help = "cells of a view map along each side"}),
      row<BuildChoice>("higher_view_size", [](auto& o) -> auto& { return o.compression.higherViewSize; },
                       {.domain = wholeRange(kLeastViewSize, kLargestViewSize),
                        .help = "cells of view maps from the second term on; default: as in the first"}),
      row<BuildChoice>("terms", [](auto& o) -> auto& { return o.terms; },
                       {.domain = wholeRange(0, kMostTerms),
                        .help = "products for each vertex, at most; default: 3, or 16 with --tolerance"}),
      row<BuildChoice>("tolerance", [](auto& o) -> auto& { return o.options.tolerance; },
                       {.domain = method::Range{0, 1},
                        .help = "stop adding terms once the RMS error of square roots is below this share of "
                                "white's; 0: all terms"}),
      row<BuildChoice>(
          "factors", [](auto& o) -> auto& { return o.options.method; },
          {.domain = words({"pca", "nmf"}),
           .help =
               "a mean and signed maps, the strongest first (pca), or maps without negative values (nmf)"}),
      row<BuildChoice>(
          "visible", [](auto& o) -> auto& { return o.options.visible; },
          {.domain = words({"sample", "triangle"}),
           .paper = "triangle",
           .help = "photographs of a surface sample: those that see it, or that see its whole triangle"}),
      row<BuildChoice>(
          "vq", [](auto& o) -> auto& { return o.compression.ratio; },
          {.domain = method::Range{1, 1e6}, .help = "vector quantisation: maps for each stored codeword"}),
      row<BuildChoice>(
          "vq_error", [](auto& o) -> auto& { return o.compression.error; },
          {.domain = method::Range{1e-6, 1},
           .help = "vector quantisation: as few maps as this RMS error of values within -1..1 allows"}),
      row<BuildChoice>("vq_start", [](auto& o) -> auto& { return o.compression.start; },
                       {.domain = words({"split", "pairs"}),
                        .help = "first codebook: split from one map, or merged from pairs of near maps"}),
      row<BuildChoice>("vq_means", [](auto& o) -> auto& { return o.compression.means; },
                       {.paper = "on", .help = "vector quantisation of the means, too"}),
      row<BuildChoice>("s3tc", [](auto& o) -> auto& { return o.compression.s3tc; },
                       {.help = "store maps as S3TC (DXT1) blocks, which the GPU reads"})};
  return kRows;
}

void checkBuild(const Setting& setting) {
  const BuildChoice choice = method::applied(BuildChoice{}, buildRows(), setting);
  const Compression& compression = choice.compression;
  if (compression.ratio && compression.error) throw Error("excludes --vq-error").at("--vq");
  if (compression.start && !compression.hasCodebooks())
    throw Error("needs --vq or --vq-error").at("--vq-start");
  if (compression.means && !compression.hasCodebooks())
    throw Error("needs --vq or --vq-error").at("--vq-means");
}

// Compresses finished maps, the source.
method::BuildReport compressModel(const method::BuildInput& input, const Compression& compression,
                                  const Progress& progress) {
  requireCompression(input, compression);
  const Stopwatch watch;
  OpenedMaps opened = openMaps(input.source, progress);
  const LightFieldMaps maps =
      inFile(input.source, [&] { return compressed(std::move(opened.maps), compression, progress); });
  method::BuildReport report;
  report.seconds["compression"] = watch.seconds();
  writeMaps(maps, opened.folder, input.output, progress);
  addCompressed(maps, input, report);
  return report;
}

method::BuildReport buildModel(const method::BuildInput& input, const Setting& setting,
                               const Progress& progress) {
  const Stopwatch watch;
  const BuildChoice choice = method::applied(BuildChoice{}, buildRows(), setting);
  if (lightfield::isFinished(input.source, kFormatTag))
    return compressModel(input, choice.compression, progress);
  BuildOptions options = choice.options;
  requireViewSize(choice.compression, options.viewSize); // before all work
  lightfield::Views views = lightfield::viewsOf(input, progress);
  options.terms = choice.terms.value_or(options.tolerance > 0 ? kTermsWithTolerance : options.terms);
  Resolution resolution = resolutionFor(views, choice.triangles.value_or(0), choice.samples.value_or(0));
  options.samples = resolution.samples;
  views.replaceMesh(std::move(resolution.mesh), progress);
  requireRatio(choice.compression, views.mesh());
  lightfield::foretellMemory(input, lightfield::photographMemory(views), "photographs");
  lightfield::foretellMemory(input, memoryFor(Rings(views.mesh(), progress), sizesOf(views, options)),
                             "matrices and maps");
  BuildReport report;
  LightFieldMaps built = build(views, options, report, progress);
  const Stopwatch compression;
  built = compressed(std::move(built), choice.compression, progress);
  report.seconds["compression"] = compression.seconds();
  writeMaps(built, views.capture(), input.output, progress);
  const MapBytes maps = bytesOf(built);
  const std::vector<double> rms = relativeErrors(report);
  const uint64_t photographBytes = lightfield::pictureBytes(views);
  const double unseen =
      static_cast<double>(report.unseenRows) / static_cast<double>(std::max<size_t>(1, report.rows));
  input.say(fmt::format("{} triangles of {} samples along an edge, {} vertices with {:.1f} terms on average",
                        built.mesh.triangles.size(), options.samples, report.vertices, report.meanTerms));
  if (unseen > 0)
    input.say(
        fmt::format("{:.1f} % of the surface and {} vertices are seen by no photograph: filled from around",
                    100 * unseen, report.unseenVertices));
  input.say(fmt::format(
      "error of square roots before compression: {:.2f} % of white's with no term, {:.2f} % with all",
      100 * rms.front(), 100 * rms.back()));
  input.say(fmt::format(
      "{}: maps of {}, {:.0f} times smaller than the resampled light field; the photographs' files take {}; "
      "{:.1f} s",
      input.output.string(), lightfield::mebibytes(maps.total()),
      lightfield::ratioOf(report.resampledBytes, maps.total()), lightfield::mebibytes(photographBytes),
      watch.seconds()));
  const auto count = [](auto number) { return static_cast<double>(number); };
  method::BuildReport result{
      .counts = {{"photographs", count(report.photographs)},
                 {"triangles", count(built.mesh.triangles.size())},
                 {"vertices", count(report.vertices)},
                 {"samples", options.samples},
                 {"white", report.white},
                 {"mean_terms", report.meanTerms},
                 {"unseen_share", unseen},
                 {"unseen_vertices", count(report.unseenVertices)},
                 {"photograph_bytes", count(photographBytes)},
                 {"normalized_bytes", count(report.normalizedBytes)},
                 {"resampled_bytes", count(report.resampledBytes)},
                 {"compression", lightfield::ratioOf(report.resampledBytes, maps.total())},
                 {"bytes", count(method::modelBytes(input.output))}},
      .lists = {{"rms", rms}},
      .seconds = report.seconds};
  addMapBytes(maps, result);
  return result;
}

// ---------------------------------------------------------------------------------------------------------
// Rendering

struct RenderOptions {
  int samples = lightfield::kSamples;
  FrameOptions frame = {};
  std::optional<double> white; // none: the maps'
};

const method::Rows<RenderOptions>& renderRows() {
  static const method::Rows<RenderOptions> kRows{
      lightfield::samplesRow<RenderOptions>(),
      row<RenderOptions>(
          "terms", [](auto& o) -> auto& { return o.frame.terms; },
          {.domain = wholeRange(0, kMostTerms), .help = "approximation terms that are added to the mean"}),
      row<RenderOptions>(
          "passes", [](auto& o) -> auto& { return o.frame.passes; },
          {.domain = words({"single", "per_term", "clamped"}),
           .paper = "clamped",
           .help = "one pass for all terms; one for each; or passes into 8 bits, two for each signed term"}),
      row<RenderOptions>("white", [](auto& o) -> auto& { return o.white; },
                         {.domain = method::Range{1e-6, 1e6},
                          .help = "largest radiance of 8 bits; default: that of the mean maps",
                          .needs = {{"passes", {"clamped"}}}})};
  return kRows;
}

// Open maps and their frames, which belong to the context's thread.
struct OpenLfm {
  std::shared_ptr<const gl::Context> context = gl::contextOfThread();
  std::vector<Point3<AcquisitionSpace>> points;
  FrameRenderer frames;
  RenderOptions options = {};
  double white = 1;
  size_t triangles = 0;

  explicit OpenLfm(LightFieldMaps maps)
      : frames(maps, context->describe().limits), white(maps.meanWhite * maps.meanWhite),
        triangles(maps.mesh.triangles.size()) {
    points = std::move(maps.mesh.positions);
  }

  void draw(const capture::Camera<AcquisitionSpace>& camera, const std::vector<std::string>& aovs,
            const Progress& progress, method::FrameLayers& layers) {
    FrameOptions frameOptions = options.frame;
    frameOptions.white = options.white.value_or(white);
    const Frame frame = frames.render(lightfield::sampled(camera, options.samples), frameOptions, progress);
    progress.checkpoint();
    layers.color = image::squareMeans(frame.color, options.samples);
    progress.checkpoint();
    if (lightfield::isAsked(aovs, "depth"))
      layers.aovs["depth"] = image::squareMinima(frame.depth, options.samples);
    layers.report.seconds = {{"depth", frame.stats.depthSeconds},
                             {"draw", frame.stats.drawSeconds},
                             {"read", frame.stats.readSeconds}};
    const auto count = [](size_t number) { return static_cast<double>(number); };
    layers.report.counts = {
        {"work.texels", lightfield::samplesOf(camera, options.samples) * count(1 + frame.stats.terms)},
        {"passes", count(frame.stats.passes)},
        {"terms", count(frame.stats.terms)},
        {"triangles", count(triangles)},
        {"texture_bytes", count(frames.textures().bytes())}};
  }
};

// The rows of given maps: the first terms of NMF approximate nothing.
std::vector<Option> rowsOf(const LightFieldMaps& maps) {
  std::vector<Option> rows = method::optionsOf(renderRows());
  const auto terms = std::ranges::find(rows, "terms", &Option::name);
  const size_t all = maps.terms.size();
  const float meanWhite = maps.meanWhite;
  std::ranges::find(rows, "white", &Option::name)->standard = meanWhite * meanWhite; // of a root
  if (maps.method == Factorization::nmf) {
    rows.erase(terms);
    return rows;
  }
  terms->domain = wholeRange(0, static_cast<double>(all));
  terms->standard = all;
  for (size_t k = all + 1; k-- > 0;) terms->sweep.emplace_back(k);
  return rows;
}

// `identity` names the content of the maps.
std::unique_ptr<method::Renderer> rendererOf(LightFieldMaps maps, capture::Capture rig,
                                             const std::filesystem::path& folder, const std::string& identity,
                                             const Setting& setting) {
  std::vector<Option> rows = rowsOf(maps);
  const std::map<std::string, size_t> counts = {{"terms", maps.terms.size()},
                                                {"triangles", maps.mesh.triangles.size()},
                                                {"map_bytes", bytesOf(maps).total()}};
  const auto lfm = std::make_shared<OpenLfm>(std::move(maps));
  lightfield::LightFieldRenderer::Parts parts = lightfield::partsOf(
      lfm, renderRows(),
      {.method = lfmMethod().tag,
       .folder = folder,
       .identity = fmt::format("light field maps {} {}", identity, lfm->context->driver()),
       .counts = counts,
       .rig = std::move(rig),
       .middle = middleOf(lfm->points),
       .points = lfm->points,
       .aovs = {"depth"}});
  parts.options = std::move(rows);
  return std::make_unique<lightfield::LightFieldRenderer>(std::move(parts), setting);
}

std::unique_ptr<method::Renderer> open(const std::filesystem::path& folder, const Setting& setting,
                                       const Progress& progress) {
  OpenedMaps opened = openMaps(folder, progress);
  return rendererOf(std::move(opened.maps), opened.folder.rig(), folder, hex(opened.folder.identity()),
                    setting);
}

} // namespace

std::unique_ptr<method::Renderer> openScene(std::span<const std::filesystem::path> models,
                                            std::span<const PlacedObject> objects, const Setting& setting,
                                            const Progress& progress) {
  std::vector<LightFieldMaps> maps;
  std::vector<lightfield::LightFieldFolder> folders;
  std::string identity;
  for (const std::filesystem::path& model : models) {
    OpenedMaps opened = openMaps(model, progress);
    maps.push_back(std::move(opened.maps));
    folders.push_back(std::move(opened.folder));
    identity += (identity.empty() ? "" : "+") + hex(folders.back().identity());
  }
  atField("object",
          [&] { requireMemory(memoryOf(maps, objects), fmt::format("{} objects", objects.size())); });
  std::vector<const capture::Capture*> rigs;
  for (const lightfield::LightFieldFolder& folder : folders) rigs.push_back(&folder.rig());
  for (const auto& [model, placement] : objects) {
    identity += fmt::format(" {} at {} {} {}", model, placement.position.x(), placement.position.y(),
                            placement.position.z());
    identity += fmt::format(" times {}", placement.scale);
    for (const double entry : placement.rotation.reshaped()) identity += fmt::format(" {}", entry);
  }
  return rendererOf(joined(maps, objects), joinedRig(rigs, objects), models.front(), identity, setting);
}

const method::Method& lfmMethod() {
  static const method::Method kMethod{
      .tag = "lfm",
      .title = "light field maps: products of surface maps and view maps",
      .paper = "Chen et al. 2002",
      .format = kFormatTag,
      .buildOptions = method::optionsOf(buildRows()),
      .renderOptions = method::optionsOf(renderRows()),
      .compressOptions = {"higher_view_size", "vq", "vq_error", "vq_start", "vq_means", "s3tc"},
      .checkBuild = checkBuild,
      .build = buildModel,
      .open = open};
  return kMethod;
}

} // namespace surflect::lfm
