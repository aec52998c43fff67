#include "render/surfels/surfel_method.h"

#include "render/method/rows.h"
#include "render/surfels/frame_work.h"
#include "srf/model/manifest.h"
#include "srf/weights/interpolation.h"
#include "srf/weights/ulr.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/math/simd.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace surflect::surfels {

namespace {

using method::Option, method::Setting, method::Value, method::row, method::wholeRange, method::words;

// Options as they are given: those of a frame, and what is kept between frames.
struct SurfelOptions {
  FrameOptions frame;
  size_t cacheMb = 1024;
  bool reuse = false;
};

constexpr const char *kInterpolation = "interpolation", *kNearest = "nearest";

// Unlike other choices, "nearest" is no enumerator: it weights as the model does, but takes one photograph.
method::Row<SurfelOptions> interpolationRow() {
  Option option{.name = kInterpolation,
                .domain = words({"paper", "separate", "kriging", "shared", kNearest}),
                .paper = "paper",
                .help =
                    "weights of photographs: by cameras and lights apart, as published (paper) or with "
                    "fitted lights (separate); by kriging of camera-light pairs; by tables that surfels of a "
                    "kind share, corrected by each surfel's photographs (shared); or the nearest photograph "
                    "alone"};
  return {option, [](SurfelOptions& options, const Value& value) {
            weights::ShadeOptions& shade = options.frame.shade;
            if ((shade.nearest = value == Value(kNearest))) return;
            for (const auto kind : {weights::Interpolation::paper, weights::Interpolation::separate,
                                    weights::Interpolation::kriging, weights::Interpolation::shared})
              if (value == Value(std::string(nameOf(kind)))) shade.interpolation = kind;
          }};
}

const method::Rows<SurfelOptions>& rows() {
  const auto blended = wholeRange(1, weights::kMaxBlended);
  const std::pair<std::string, std::vector<Value>> kriging{kInterpolation, {"kriging", "shared"}};
  static const method::Rows<SurfelOptions> kRows{
      interpolationRow(),
      row<SurfelOptions>("cameras", [](auto& o) -> auto& { return o.frame.shade.cameras; },
                         {.domain = blended, .help = "cameras blended per surfel"}),
      row<SurfelOptions>("lights", [](auto& o) -> auto& { return o.frame.shade.lights; },
                         {.domain = blended, .help = "captured lights blended per light of the script"}),
      row<SurfelOptions>(
          "pairs", [](auto& o) -> auto& { return o.frame.shade.pairs; },
          {.domain = blended,
           .help = "camera-light pairs blended under kriging (6 by default), and where not all were captured "
                   "(4)"}),
      row<SurfelOptions>("light_fit", [](auto& o) -> auto& { return o.frame.shade.lightFit; },
                         {.domain = words({"mean", "plane"}), .help = "mean or plane of the blended lights"}),
      row<SurfelOptions>("foreshortening", [](auto& o) -> auto& { return o.frame.shade.foreshortened; },
                         {.help = "scale blended lights by their cosines to the surface"}),
      row<SurfelOptions>(
          "reciprocity", [](auto& o) -> auto& { return o.frame.shade.reciprocal; },
          {.help = "let photographs also answer for camera and light exchanged", .needs = kriging}),
      row<SurfelOptions>(
          "shadows", [](auto& o) -> auto& { return o.frame.shadows; },
          {.help =
               "find shadows by rays: photographs that show a surfel lit then answer for lit surfels, and "
               "those that show it in shadow for shadowed ones",
           .needs = kriging}),
      row<SurfelOptions>(
          "tangents", [](auto& o) -> auto& { return o.frame.tangents; },
          {.domain = words({"polar", "bisector", "along", "across"}),
           .paper = "bisector",
           .help = "orthonormal tangents of a warped surfel: polar factor, or Eq. 8 of Weyrich 2005; or "
                   "the line along or across the fibre of a model's tables follows the warp"}),
      row<SurfelOptions>(
          "low_pass", [](auto& o) -> auto& { return o.frame.splats.lowPass; },
          {.domain = method::Range{0, 10}, .help = "least standard deviation of a splat, pixels"}),
      row<SurfelOptions>("weight_error", [](auto& o) -> auto& { return o.frame.shade.weightError; },
                         {.domain = method::Range{0, weights::kMostTruncated},
                          .preview = 0.05,
                          .sweep = {0, 0.02, 0.05, 0.1, 0.2, 0.4},
                          .help = "weight that may be left out of a blend of cameras or lights"}),
      row<SurfelOptions>(
          "environment_error", [](auto& o) -> auto& { return o.frame.environmentError; },
          {.domain = method::Range{0, 1},
           .preview = 0.05,
           .sweep = {0, 0.02, 0.05, 0.1, 0.2},
           .help = "error of captured lights' weights, within which few lights stand for an environment"}),
      row<SurfelOptions>(
          "layer_search", [](auto& o) -> auto& { return o.frame.splats.searchLayers; },
          {.preview = method::kOff,
           .sweep = words({method::kOn, method::kOff}),
           .help =
               "search for all splats of a pixel's nearest surface; off: only until they fill the pixel"}),
      row<SurfelOptions>("surfel_size", [](auto& o) -> auto& { return o.frame.surfelSize; },
                         {.domain = method::Range{0, 64},
                          .preview = 0.7,
                          .sweep = {0, 0.5, 0.7, 1, 1.4, 2, 2.8},
                          .help = "pixels between neighbouring surfels at least; 0: all surfels"}),
      row<SurfelOptions>("patch", [](auto& o) -> auto& { return o.frame.surfelsPerQuery; },
                         {.domain = wholeRange(1, 4096),
                          .preview = 4,
                          .sweep = {1, 2, 4, 8, 16},
                          .help = "surfels for each query of weights: they share them, or, under kriging and "
                                  "tables, blend those of four corners (default: 4 under kriging, else 1)"}),
      row<SurfelOptions>(
          "cache_mb", [](auto& o) -> auto& { return o.cacheMb; },
          {.domain = wholeRange(0, 1 << 24), .help = "memory for decoded blocks, MiB", .atOpening = true}),
      row<SurfelOptions>(
          "reuse", [](auto& o) -> auto& { return o.reuse; },
          {.help = "take over stages of the last frame while only lamps or only the camera move; same "
                   "pictures, up to 1 GiB more memory",
           .atOpening = true})};
  return kRows;
}

const method::Rows<model::PackOptions>& packRows() {
  static const method::Rows<model::PackOptions> kRows{
      row<model::PackOptions>(
          "hull", [](auto& o) -> auto& { return o.impostor.hull; },
          {.help = "an opacity hull, of all pixels with alpha above 0, instead of the capture's mesh"}),
      row<model::PackOptions>(
          "relief", [](auto& o) -> auto& { return o.impostor.relief; },
          {.help = "geometry from shading, for a capture of one view under three lights or more"}),
      row<model::PackOptions>("tolerance", [](auto& o) -> auto& { return o.tolerance; },
                              {.domain = method::Range{0, 1}, .help = "relative error of every block"}),
      row<model::PackOptions>(
          "surfels", [](auto& o) -> auto& { return o.surfels; },
          {.domain = wholeRange(1, model::kMostSurfels),
           .help =
               "how many, about; default: two across a pixel, up to 4 million or half of memory; one view "
               "without a mesh: corners of a grid, whose step is 1, 2, 4 or 8 pixels"}),
      row<model::PackOptions>("opaque", [](auto& o) -> auto& { return o.opaque; },
                              {.help = "take alpha as a mask, even if many pixels are translucent"}),
      row<model::PackOptions>(
          "tables", [](auto& o) -> auto& { return o.tables; },
          {.help = "let surfels of a kind share their reflectance in tables; off: pack sooner"}),
      row<model::PackOptions>(
          "overwrite", [](auto& o) -> auto& { return o.overwrite; },
          {.help =
               "replace a finished model of another capture, geometry, tolerance or version of surflect"})};
  return kRows;
}

// n, n - 1, .. 1
std::vector<Value> downToOne(size_t n) {
  std::vector<Value> values;
  for (size_t value = n; value >= 1; --value) values.emplace_back(value);
  return values;
}

// Options of splats and patches of surfels.
constexpr std::array<std::string_view, 4> kOfSplats{"low_pass", "layer_search", "surfel_size", "patch"};

// The rows of a model's frames: defaults that the model chose, and the values to sweep where a frame with the
// given interpolation depends on them.
std::vector<Option> rowsOf(const weights::ReflectanceField& field, const weights::ShadeOptions& given) {
  weights::ShadeOptions shade; // with the defaults of all counts
  shade.interpolation = given.interpolation;
  shade.nearest = given.nearest;
  std::vector<Option> options = method::optionsOf(rows());
  const auto rowOf = [&](const char* name) -> Option& {
    return *std::ranges::find(options, name, &Option::name);
  };
  if (field.grid) // nothing is splatted, and each corner has weights of its own
    std::erase_if(options, [](const Option& option) {
      return std::ranges::count(kOfSplats, std::string_view(option.name)) > 0;
    });
  const auto chosen = weights::interpolationOf(field, {});
  const bool isLit = !field.rig.lights.empty(), isProduct = field.isFullProduct || !isLit;
  rowOf(kInterpolation).standard = std::string(nameOf(chosen));
  if (shade.nearest) {
    for (Option& option : options) option.sweep.clear();
    return options;
  }
  if (weights::usesTables(field, shade))
    rowOf(kInterpolation).sweep = words({"shared", "kriging", "separate"});
  else if (weights::usesKriging(field, shade))
    rowOf(kInterpolation).sweep = words({"kriging", "separate"});
  if (isProduct) rowOf("cameras").sweep = downToOne(shade.cameras);
  if (isProduct && isLit) {
    const size_t lights = weights::lightBlend(field, shade).lights;
    rowOf("lights").standard = lights;
    rowOf("lights").sweep = downToOne(lights);
  }
  if (!weights::hasSeparateWeights(field, shade))
    rowOf("pairs").sweep = downToOne(weights::pairCount(field, shade));
  if (!isLit) rowOf("environment_error").sweep.clear();
  if (field.grid) return options;
  const size_t perCorner = surfelsPerCorner(field, shade);
  rowOf("patch").standard = perCorner;
  if (perCorner > 1) rowOf("patch").sweep = {perCorner, 2 * perCorner, 4 * perCorner};
  return options;
}

// Setting without the options of splats that only a preset can have set. Others are then refused by name.
Setting withoutPresetsOfSplats(Setting setting) {
  for (const Option& option : surfelMethod().renderOptions) {
    const auto found = setting.find(option.name);
    if (found == setting.end() || std::ranges::count(kOfSplats, std::string_view(option.name)) == 0) continue;
    if (found->second == option.preview || found->second == option.paper || found->second == option.standard)
      setting.erase(found);
  }
  return setting;
}

SurfelOptions optionsOf(const Setting& setting) { return method::applied(SurfelOptions{}, rows(), setting); }

SurfelOptions checkedOptions(const Setting& setting) {
  method::requireSetting({surfelMethod().tag, surfelMethod().renderOptions}, setting);
  return optionsOf(setting);
}

method::FrameReport reportOf(const FrameStats& stats, const FrameOptions& options, size_t pixels) {
  const shading::ShadingStats& shading = stats.shading;
  const auto count = [](size_t number) { return static_cast<double>(number); };
  method::FrameReport report{
      stats.seconds,
      stats.processorSeconds,
      {{"lookups", count(shading.lookups)},
       {"operations", count(shading.operations)},
       {"lost", count(shading.lost)},
       {"tasks", count(shading.tasks)},
       {"mean_rank", shading.tasks ? count(shading.taskRanks) / count(shading.tasks) : 0},
       {"blocks_read", count(shading.blocksRead)},
       {"bytes_read", count(shading.bytesRead)},
       {"cache_hits", count(shading.cacheHits)},
       {"surfels.warped", count(stats.surfels)},
       {"surfels.drawn", count(stats.splats.drawn)},
       {"surfels.visible", count(stats.visible)},
       {"surfels.unseen", count(stats.unseen)},
       {"shadows.unmatched", count(stats.unmatchedShadows)},
       {"surfels.dead", count(stats.splats.dead)},
       {"surfels.not_finite", count(stats.splats.notFinite)},
       {"surfels.back_facing", count(stats.splats.backFacing)},
       {"surfels.too_near", count(stats.splats.tooNear)},
       {"surfels.outside", count(stats.splats.outside)}},
      emptyFrame(stats, stats.surfels)};
  for (const auto& [stage, work] : workOf(stats, options, pixels)) report.counts["work." + stage] = work;
  return report;
}

// Throws Error if tangents need fibres, and the model has no tables.
void requireFibres(const model::Model& model, Tangents tangents) {
  if (model.shared || (tangents != Tangents::along && tangents != Tangents::across)) return;
  throw Error::mismatch("polar or bisector, as the model has no tables",
                        tangents == Tangents::along ? "along" : "across")
      .at("tangents")
      .in(model.folder);
}

} // namespace

model::PackOptions packOptions(const Setting& setting) {
  return method::applied(model::PackOptions{}, packRows(), setting);
}

FrameOptions frameOptions(const Setting& setting) { return optionsOf(setting).frame; }

SurfelRenderer::SurfelRenderer(std::shared_ptr<const model::Model> model, const Setting& setting)
    : model_(std::move(model)), rows_(rowsOf(*model_, checkedOptions(setting).frame.shade)),
      points_(model_->grid ? placesOnObject(model_->cloud) : std::vector<Point3<AcquisitionSpace>>{}),
      description_{.method = surfelMethod().tag,
                   .folder = model_->folder,
                   .counts = {{"surfels", model_->cloud.size()}},
                   .rig = model_->rig,
                   .middle = model_->middle,
                   .points = model_->grid ? points_ : model_->cloud.p0,
                   .aovs = {scene::aovNames.begin(), scene::aovNames.end()}},
      workspace_(*model_, optionsOf(setting).cacheMb << 20) {
  if (model_->grid) std::erase(description_.aovs, "predicted_error");
  workspace_.keepsStages = optionsOf(setting).reuse;
  set(method::forFrames(rows_, model_->grid ? withoutPresetsOfSplats(setting) : setting));
}

void SurfelRenderer::configure(const Setting& setting) {
  FrameOptions options = frameOptions(setting);
  requireFibres(*model_, options.tangents);
  options_ = std::move(options);
  description_.identity =
      fmt::format("model {} {} simd {}", hex(model_->identity),
                  method::textOf(method::withoutDefaults(rowsOf(*model_, options_.shade), setting)),
                  bestSimd() == Simd::scalar ? "scalar" : "vector");
}

method::FrameLayers SurfelRenderer::render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                                           const Progress& progress, method::FrameLayers memory) {
  options_.aovs = aovs;
  workspace_.layers = std::move(memory);
  method::FrameLayers layers = renderFrame(*model_, scene, options_, workspace_, progress);
  const auto pixels = static_cast<size_t>(layers.color.width) * static_cast<size_t>(layers.color.height);
  layers.report = reportOf(workspace_.stats, options_, pixels);
  return layers;
}

method::PhotographBlend SurfelRenderer::blendedAt(const scene::Scene& scene, capture::Pixel pixel,
                                                  const Progress& progress) {
  return surfels::blendedAt(*model_, scene, pixel, options_, workspace_, progress);
}

method::EnvironmentReport SurfelRenderer::prepare(const scene::ShotEnvironment& environment,
                                                  const Progress& progress) {
  const Stopwatch watch;
  const PreparedEnvironment& prepared = workspace_.environments.prepared(
      coarsened(environment, options_.environmentError), *model_, options_.shade, progress);
  return {prepared.lights.size() + prepared.keyLights.size(), prepared.keyLights.size(),
          prepared.table.has_value(), watch.seconds()};
}

std::optional<std::string> emptyFrame(const FrameStats& stats, size_t surfels) {
  const size_t dead = stats.splats.dead, notFinite = stats.splats.notFinite;
  if (2 * (dead + notFinite) > surfels)
    return fmt::format("{} of {} surfels have no place or no area once warped", dead + notFinite, surfels);
  if (stats.visible == 0)
    return fmt::format(
        "nothing is visible: of {} surfels {} face away, {} are too near and {} off the picture", surfels,
        stats.splats.backFacing, stats.splats.tooNear, stats.splats.outside);
  return std::nullopt;
}

const method::Method& surfelMethod() {
  static const method::Method kMethod{
      .tag = "surfels",
      .title = "surface reflectance field: surfels that bend and are relit",
      .paper = "Weyrich, Pfister and Gross 2005",
      .format = std::string(model::kSurfelFormat),
      .isBaked = false,
      .buildOptions = method::optionsOf(packRows()),
      .renderOptions = method::optionsOf(rows()),
      .build = {},
      .open = [](const std::filesystem::path& folder, const Setting& setting, const Progress& progress) {
        return std::make_unique<SurfelRenderer>(
            std::make_shared<const model::Model>(model::openModel(folder, progress)), setting);
      }};
  return kMethod;
}

} // namespace surflect::surfels
