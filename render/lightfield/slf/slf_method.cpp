#include "render/lightfield/slf/slf_method.h"

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_renderer.h"
#include "render/lightfield/common/photographs.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/slf/build.h"
#include "render/lightfield/slf/field_file.h"
#include "render/lightfield/slf/slf_frame.h"
#include "srf/image/resize.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <utility>

namespace surflect::slf {

namespace {

using method::row, method::words, method::wholeRange, method::Setting;

// ---------------------------------------------------------------------------------------------------------
// Building

const method::Rows<BuildOptions>& buildRows() {
  static const method::Rows<BuildOptions> kRows{
      row<BuildOptions>(
          "regions", [](auto& o) -> auto& { return o.regions; },
          {.domain = wholeRange(1, 100'000), .help = "texture regions that the mesh is cut into, about"}),
      row<BuildOptions>(
          "texels", [](auto& o) -> auto& { return o.texels; },
          {.domain = wholeRange(0, 100'000'000),
           .help = "texels of the surface in one direction; 0: as fine as the photographs, 500000 at most"}),
      row<BuildOptions>("directions", [](auto& o) -> auto& { return o.directions; },
                        {.domain = std::vector<method::Value>{6, 18, 66, 258, 1026},
                         .paper = 66.0,
                         .help = "sample directions of each region; default: 18, 66 or 258, about as many as "
                                 "photographs"}),
      row<BuildOptions>(
          "tolerance", [](auto& o) -> auto& { return o.tolerance; },
          {.domain = method::Range{0, 1},
           .paper = 0.0,
           .help = "leave out directions that the others reproduce within this error, relative to white; 0: "
                   "none"}),
      row<BuildOptions>(
          "blend", [](auto& o) -> auto& { return o.blend; },
          {.domain = words({"nearest", "ulr", "fitted"}),
           .help = "photographs of a texel and direction: the nearest one; the nearest ones by their angles "
                   "(ulr); all by least squares (fitted)"})};
  return kRows;
}

method::BuildReport buildField(const method::BuildInput& input, const Setting& setting,
                               const Progress& progress) {
  const Stopwatch watch;
  const BuildOptions options = method::applied(BuildOptions{}, buildRows(), setting);
  const lightfield::Views views = lightfield::viewsOf(input, progress);
  lightfield::foretellMemory(input, lightfield::photographMemory(views), "photographs");
  const BuildReport report = build(views, options, input.output, progress);
  if (report.unseenRegions > 0)
    input.say(fmt::format("{} regions are seen by no photograph: filled from their neighbours, {} left black",
                          report.unseenRegions, report.blackRegions));
  input.say(fmt::format("{}: {} textures of {} in {} directions, {} texels of the surface, {}; {:.0f} % of "
                        "all texels are filled in, as no photograph looked from their direction; {:.1f} s",
                        input.output.string(), report.texturesStored, report.regions, report.directions,
                        report.surfaceTexels, lightfield::mebibytes(report.bytes), 100 * report.inventedShare,
                        watch.seconds()));
  const auto count = [](auto number) { return static_cast<double>(number); };
  return {.counts = {{"regions", count(report.regions)},
                     {"photographs", count(report.photographs)},
                     {"directions", count(report.directions)},
                     {"texel_size", report.texelSize},
                     {"pixel_footprint", report.pixelFootprint},
                     {"direction_meshes", count(report.directionMeshes)},
                     {"textures", count(report.textures)},
                     {"textures_stored", count(report.texturesStored)},
                     {"surface_texels", count(report.surfaceTexels)},
                     {"texels", count(report.texels)},
                     {"unseen_texels", count(report.unseenTexels)},
                     {"unseen_regions", count(report.unseenRegions)},
                     {"black_regions", count(report.blackRegions)},
                     {"invented_share", report.inventedShare},
                     {"bytes", count(report.bytes)}},
          .lists = {},
          .seconds = {{"regions", report.regionSeconds},
                      {"photographs", report.photographSeconds},
                      {"visibility", report.visibilitySeconds},
                      {"textures", report.textureSeconds},
                      {"unseen", report.fillSeconds},
                      {"files", report.fileSeconds},
                      {"all", watch.seconds()}}};
}

// ---------------------------------------------------------------------------------------------------------
// Rendering

struct RenderOptions {
  int samples = lightfield::kSamples;
  FrameOptions frame = {};
  size_t cacheMb = 1024;
};

const method::Rows<RenderOptions>& renderRows() {
  static const method::Rows<RenderOptions> kRows{
      lightfield::samplesRow<RenderOptions>(),
      row<RenderOptions>(
          "stages", [](auto& o) -> auto& { return o.frame.method; },
          {.domain = words({"fused", "two"}),
           .paper = "two",
           .help = "basis functions and regions drawn together, or one after the other through alpha"}),
      row<RenderOptions>("basis", [](auto& o) -> auto& { return o.frame.basis; },
                         {.domain = words({"perspective", "gouraud"}),
                          .paper = "gouraud",
                          .help = "hat functions exact, or linear on the screen",
                          .needs = {{"stages", {"two"}}}}),
      row<RenderOptions>(
          "cache_mb", [](auto& o) -> auto& { return o.cacheMb; },
          {.domain = wholeRange(0, 1 << 24),
           .help = "memory for textures, MiB; at most 8 array textures, of 2048 layers or more each",
           .atOpening = true})};
  return kRows;
}

// An open field and its frames, which belong to the context's thread.
struct OpenSlf {
  std::shared_ptr<const gl::Context> context = gl::contextOfThread();
  OpenedField opened;
  FrameRenderer frames;
  RenderOptions options = {};

  OpenSlf(const std::filesystem::path& folder, size_t cacheBytes, const Progress& progress)
      : opened(openField(folder, progress)),
        frames(opened.field, *opened.textures, {.bytes = cacheBytes}, context->describe().limits) {}

  void draw(const capture::Camera<AcquisitionSpace>& camera, const std::vector<std::string>& aovs,
            const Progress& progress, method::FrameLayers& layers) {
    FrameOptions frameOptions = options.frame;
    frameOptions.observed = lightfield::isAsked(aovs, "observed");
    const Frame frame = frames.render(lightfield::sampled(camera, options.samples), frameOptions, progress);
    progress.checkpoint();
    layers.color = image::squareMeans(frame.color, options.samples);
    if (frameOptions.observed) layers.aovs["observed"] = image::squareMeans(frame.observed, options.samples);
    progress.checkpoint();
    if (lightfield::isAsked(aovs, "depth"))
      layers.aovs["depth"] = image::squareMinima(frame.depth, options.samples);
    const FrameStats& stats = frame.stats;
    const auto count = [](size_t number) { return static_cast<double>(number); };
    layers.report.seconds = {{"overhead", stats.planSeconds},
                             {"texture", stats.textures.seconds},
                             {"draw", stats.drawSeconds},
                             {"read", stats.readSeconds}};
    layers.report.counts = {{"work.pixels", lightfield::samplesOf(camera, options.samples)},
                            {"regions", count(stats.regions)},
                            {"passes", count(stats.passes)},
                            {"passes_all", count(stats.allPasses)},
                            {"triangles", count(stats.triangles)},
                            {"texture_hits", count(stats.textures.hits)},
                            {"texture_misses", count(stats.textures.misses)},
                            {"texture_bytes", count(stats.textures.bytes)}};
  }
};

std::unique_ptr<method::Renderer> open(const std::filesystem::path& folder, const Setting& setting,
                                       const Progress& progress) {
  const RenderOptions given = method::applied(RenderOptions{}, renderRows(), setting);
  const auto slf = std::make_shared<OpenSlf>(folder, given.cacheMb << 20, progress);
  const Field& field = slf->opened.field;
  lightfield::LightFieldRenderer::Parts parts = lightfield::partsOf(
      slf, renderRows(),
      {.method = slfMethod().tag,
       .folder = folder,
       .identity = fmt::format("surface light field {} {}", hex(slf->opened.folder.identity()),
                               slf->context->driver()),
       .counts = {{"regions", field.regions.size()},
                  {"textures", field.textures()},
                  {"texture_slots", slf->frames.slots().shape().count},
                  {"texels", slf->opened.folder.count("texels", 0, size_t{1} << 50)},
                  {"triangles", field.mesh.triangles.size()}},
       .rig = slf->opened.folder.rig(),
       .middle = middleOf(field.mesh.positions),
       .points = field.mesh.positions,
       .aovs = {"depth", "observed"}});
  return std::make_unique<lightfield::LightFieldRenderer>(std::move(parts), setting);
}

} // namespace

const method::Method& slfMethod() {
  static const method::Method kMethod{.tag = "slf",
                                      .title = "surface light field: textures of the mesh by direction",
                                      .paper = "Azuma 1999",
                                      .format = kFormatTag,
                                      .buildOptions = method::optionsOf(buildRows()),
                                      .renderOptions = method::optionsOf(renderRows()),
                                      .build = buildField,
                                      .open = open};
  return kMethod;
}

} // namespace surflect::slf
