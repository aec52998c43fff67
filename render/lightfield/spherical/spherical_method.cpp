#include "render/lightfield/spherical/spherical_method.h"

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/common/light_field_renderer.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/spherical/flight.h"
#include "render/lightfield/spherical/image_cache.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace surflect::spherical {

namespace {

using method::row, method::wholeRange, method::words, method::Setting, method::Option;

// ---------------------------------------------------------------------------------------------------------
// Building

struct BuildChoice {
  BuildOptions options = {};
  lightfield::RayBlend rays = {};
};

const method::Rows<BuildChoice>& buildRows() {
  static const method::Rows<BuildChoice> kRows{
      row<BuildChoice>(
          "levels", [](auto& o) -> auto& { return o.options.levels; },
          {.domain = wholeRange(1, kMostLevels),
           .help = "levels of detail: 20 images in one level, four times as many with each further one"}),
      row<BuildChoice>("size", [](auto& o) -> auto& { return o.options.size; },
                       {.domain = std::vector<method::Value>{8, 16, 32, 64, 128, 256, 512, 1024},
                        .help = "texels along each side of an image"}),
      row<BuildChoice>("nearest", [](auto& o) -> auto& { return o.rays.nearest; },
                       {.help = "take the nearest view for each ray, do not blend"})};
  return kRows;
}

method::BuildReport buildModel(const method::BuildInput& input, const Setting& setting,
                               const Progress& progress) {
  const Stopwatch watch;
  const BuildChoice choice = method::applied(BuildChoice{}, buildRows(), setting);
  const lightfield::Views views = lightfield::viewsOf(input, progress);
  lightfield::foretellMemory(input, lightfield::photographMemory(views), "photographs");
  return reportOf(build(views, choice.options, choice.rays, input.output, progress), input, watch.seconds());
}

// ---------------------------------------------------------------------------------------------------------
// Rendering

struct RenderOptions {
  int samples = lightfield::kSamples;
  std::optional<double> level;
  double mip = 0;
  bool interpolated = true, depth = true;
  size_t cacheMb = 1024;
};

const method::Rows<RenderOptions>& renderRows() {
  static const method::Rows<RenderOptions> kRows{
      lightfield::samplesRow<RenderOptions>(),
      row<RenderOptions>("level", [](auto& o) -> auto& { return o.level; },
                         {.domain = method::Range{0, kMostLevels - 1},
                          .help = "level of detail: pencils of level n, and with a fraction also of n + 1"}),
      row<RenderOptions>("mip", [](auto& o) -> auto& { return o.mip; },
                         {.domain = method::Range{0, 10},
                          .help = "positional detail: the finest mip level of the images that is shown"}),
      row<RenderOptions>("interpolated", [](auto& o) -> auto& { return o.interpolated; },
                         {.paper = method::kOff,
                          .sweep = words({method::kOn, method::kOff}),
                          .help = "blend neighbouring pencils; off: show one for each pixel"}),
      row<RenderOptions>("depth", [](auto& o) -> auto& { return o.depth; },
                         {.paper = method::kOff,
                          .preview = method::kOff,
                          .sweep = words({method::kOn, method::kOff}),
                          .help = "show the points of the object's mesh; off: those of an image's plane"}),
      row<RenderOptions>("cache_mb", [](auto& o) -> auto& { return o.cacheMb; },
                         {.domain = wholeRange(0, 1 << 24),
                          .help = "memory for images, MiB, and as much on the GPU",
                          .atOpening = true})};
  return kRows;
}

// An open field, its cache and its frames, which belong to the context's thread.
struct OpenSpherical {
  lightfield::LightFieldFolder folder;
  SphericalFile file;
  DirectionTree tree;
  std::shared_ptr<const gl::Context> context = gl::contextOfThread();
  CacheSlots slots;
  SphericalFrame frame;
  TaskLoader loader;
  FrameTimeModel times;
  ImageCache cache;
  std::optional<double> budget;
  std::optional<Flight> flight; // of the last budget, which goes on where it stopped
  bool isInTime = false;        // whether frames keep the budget
  RenderOptions options = {};

  OpenSpherical(const std::filesystem::path& path, size_t cacheBytes, const Progress& progress)
      : folder(path, kFormat, kVersion, progress), file(folder), tree(file.shape().levels),
        slots(slotsFor(file.shape(), {cacheBytes, cacheBytes},
                       static_cast<size_t>(context->describe().limits.arrayLayers))),
        frame(tree, file.shape(), slots.gpu, folder.mesh()), loader(file),
        times(tree.levels(), measuredTimes(file, frame)), cache(slots, loader, frame) {}

  double finest() const { return static_cast<double>(tree.levels() - 1); }

  bool keepBudget(std::optional<double> seconds) {
    if (seconds && options.level) throw Error("has no effect beside --budget-ms").at("--level");
    if (seconds && seconds != budget) {
      flight.emplace(tree, cache, times, FlightOptions{.budget = seconds});
      budget = seconds;
    }
    isInTime = seconds.has_value();
    return true;
  }

  void draw(const capture::Camera<AcquisitionSpace>& camera, const std::vector<std::string>& aovs,
            const Progress& progress, method::FrameLayers& layers) {
    const Look look{options.level.value_or(finest()), options.mip, options.depth, options.interpolated};
    isInTime ? drawInTime(camera, look, layers) : drawWhole(camera, look, progress, layers);
    const bool isDepthAsked = lightfield::isAsked(aovs, "depth");
    const gl::Stopwatch reading;
    Picture picture = frame.read(isDepthAsked, progress);
    layers.report.seconds["read"] = reading.seconds();
    layers.color = std::move(picture.color);
    if (isDepthAsked) layers.aovs["depth"] = std::move(picture.depth);
    layers.report.counts["texture_bytes"] = static_cast<double>(frame.textureBytes());
  }

private:
  auto addTriangles(const Progress& progress) {
    return [this, &progress](std::span<const TexturedTriangle> triangles) { frame.add(triangles, progress); };
  }

  // Every pencil shows its own image, however long loading takes.
  void drawWhole(const capture::Camera<AcquisitionSpace>& camera, const Look& look, const Progress& progress,
                 method::FrameLayers& layers) {
    gl::Stopwatch planning;
    const FramePlan plan = planFrame(tree, windowOf(camera, file.shape().sphere), look, progress);
    frame.begin(camera, look, options.samples, progress);
    layers.report.seconds["plan"] = planning.seconds();
    const gl::Stopwatch drawing;
    const FrameCounts counts = drawAll(plan, cache, addTriangles(progress), progress);
    layers.report.seconds["draw"] = drawing.seconds();
    const double drawn = static_cast<double>(levelShares(look.detail, tree.levels()).size()) *
                         (look.interpolated ? 6 : 1) * (look.depth ? 2 : 1);
    layers.report.counts = {{"work.pixels", drawn * lightfield::samplesOf(camera, options.samples)},
                            {"images", static_cast<double>(plan.images.size())}};
    addCounts(counts, layers);
  }

  void drawInTime(const capture::Camera<AcquisitionSpace>& camera, const Look& look,
                  method::FrameLayers& layers) {
    static const Progress kWhole; // a frame within a budget is not given up: its time is measured
    const Stopwatch watch;
    const FrameRecord record =
        flight->frame(windowOf(camera, file.shape().sphere), look,
                      {[&](const Look& chosen) { frame.begin(camera, chosen, options.samples); },
                       addTriangles(kWhole), [] { gl::finish(); }, [&] { return watch.seconds(); }});
    layers.report.seconds["draw"] = record.seconds;
    layers.report.counts = {{"level", record.detail.level},
                            {"coarser_mips", record.detail.coarser},
                            {"predicted_ms", 1e3 * record.predicted},
                            {"triangles_of_ancestors", static_cast<double>(record.counts.substituted)}};
    addCounts(record.counts, layers);
  }

  static void addCounts(const FrameCounts& counts, method::FrameLayers& layers) {
    std::map<std::string, double>& report = layers.report.counts;
    report["work.triangles"] = 1e3 * static_cast<double>(counts.triangles);
    report["triangles"] = static_cast<double>(counts.triangles);
    report["images_uploaded"] = static_cast<double>(counts.uploads);
    report["images_read"] = static_cast<double>(counts.reads);
    report["passes"] = static_cast<double>(counts.batches);
  }
};

std::unique_ptr<method::Renderer> open(const std::filesystem::path& path, const Setting& setting,
                                       const Progress& progress) {
  const RenderOptions given = method::applied(RenderOptions{}, renderRows(), setting);
  const auto spherical = std::make_shared<OpenSpherical>(path, given.cacheMb << 20, progress);
  const FieldShape& shape = spherical->file.shape();
  std::vector<Option> rows = method::optionsOf(renderRows());
  Option& level = *std::ranges::find(rows, "level", &Option::name);
  level.domain = method::Range{0, spherical->finest()};
  level.standard = spherical->finest();
  for (size_t l = shape.levels; l-- > 0;) level.sweep.emplace_back(l);
  const auto& positions = spherical->folder.mesh().positions;
  lightfield::LightFieldRenderer::Parts parts =
      lightfield::partsOf(spherical, renderRows(),
                          {.method = sphericalMethod().tag,
                           .folder = path,
                           .identity = fmt::format("spherical {} {}", hex(spherical->folder.identity()),
                                                   spherical->context->driver()),
                           .counts = {{"levels", shape.levels},
                                      {"images", shape.images()},
                                      {"image_size", static_cast<size_t>(shape.size)}},
                           .rig = spherical->folder.rig(),
                           .middle = middleOf(positions),
                           .points = positions,
                           .aovs = {"depth"}});
  parts.options = std::move(rows);
  parts.keepBudget = [spherical](std::optional<double> seconds) { return spherical->keepBudget(seconds); };
  return std::make_unique<lightfield::LightFieldRenderer>(std::move(parts), setting);
}

} // namespace

BuildOptions buildOptionsOf(const Setting& setting) {
  return method::applied(BuildChoice{}, buildRows(), setting).options;
}

method::BuildReport reportOf(const BuildReport& report, const method::BuildInput& input, double seconds) {
  const auto count = [](auto number) { return static_cast<double>(number); };
  const double onObject = count(report.seen + report.unseen);
  if (report.unseen > 0)
    input.say(
        fmt::format("{:.1f} % of the texels on the object are seen by no photograph: filled from around",
                    100 * count(report.unseen) / onObject));
  input.say(fmt::format("{}: {} images of {} x {} in {} levels, {}; {:.1f} s", input.output.string(),
                        report.shape.images(), report.shape.size, report.shape.size, report.shape.levels,
                        lightfield::mebibytes(report.bytes), seconds));
  return {.counts = {{"levels", count(report.shape.levels)},
                     {"images", count(report.shape.images())},
                     {"size", report.shape.size},
                     {"radius", report.shape.sphere.radius},
                     {"texels_seen", count(report.seen)},
                     {"texels_unseen", count(report.unseen)},
                     {"image_memory_bytes", count(imageBytes(report.shape.size))},
                     {"bytes", count(report.bytes)}},
          .lists = {{"level_bytes", {report.levelBytes.begin(), report.levelBytes.end()}}},
          .seconds = report.seconds};
}

const method::Method& sphericalMethod() {
  static const method::Method kMethod{
      .tag = "spherical",
      .title = "spherical light field: parallel projections along evenly spread directions",
      .paper = "Domingo et al. 2007",
      .format = kFormat,
      .buildOptions = method::optionsOf(buildRows()),
      .renderOptions = method::optionsOf(renderRows()),
      .build = buildModel,
      .open = open};
  return kMethod;
}

} // namespace surflect::spherical
