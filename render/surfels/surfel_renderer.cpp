#include "render/surfels/surfel_renderer.h"

#include "render/surfels/frame_work.h"
#include "surfel/base/hash.h"
#include "surfel/base/stopwatch.h"
#include "surfel/math/simd.h"

#include <fmt/format.h>

#include <algorithm>

namespace surflect::surfels {

namespace {

std::string identityOf(const model::Model& model, const FrameOptions& options) {
  const ulr::LightBlend blend = shading::lightBlend(model, options.shade);
  std::string identity = fmt::format(
      "model {} cameras {} lights {} {}{} pairs {} least-sigma {} simd {}{}", hex(model.identity),
      options.shade.cameras, blend.lights, nameOf(blend.fit), blend.foreshortened ? " foreshortened" : "",
      shading::pairCount(model, options.shade), options.splats.lowPass,
      bestSimd() == Simd::scalar ? "scalar" : "vector", options.shade.nearest ? " nearest" : "");
  if (const ulr::Interpolation kind = shading::interpolationOf(model, options.shade);
      kind != ulr::Interpolation::separate)
    identity += fmt::format(" {}", nameOf(kind));
  if (options.shade.reciprocal) identity += *options.shade.reciprocal ? " reciprocal" : " not reciprocal";
  if (options.shadows) identity += *options.shadows ? " shadows" : " no shadows";
  if (options.shade.weightError > 0) identity += fmt::format(" weight-error {}", options.shade.weightError);
  if (options.environmentError > 0)
    identity += fmt::format(" environment-error {}", options.environmentError);
  if (!options.splats.searchLayers) identity += " unsearched layers";
  if (options.surfelSize > 0) identity += fmt::format(" surfel-size {}", options.surfelSize);
  if (options.surfelsPerPatch > 1) identity += fmt::format(" patch {}", options.surfelsPerPatch);
  return identity;
}

render::FrameReport reportOf(const FrameStats& stats, const FrameOptions& options, size_t pixels) {
  const shading::ShadingStats& shading = stats.shading;
  const auto count = [](size_t number) { return static_cast<double>(number); };
  render::FrameReport report{
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

} // namespace

FrameOptions frameOptions(const render::RendererOptions& options) {
  FrameOptions frame;
  frame.shade.cameras = options.cameras;
  frame.shade.interpolation = options.interpolation;
  frame.shade.reciprocal = options.reciprocal;
  frame.shade.pairs = options.pairs;
  frame.shade.lights = options.lights;
  frame.shade.lightFit = options.lightFit;
  frame.shade.foreshortened = options.foreshortened;
  frame.shade.nearest = options.nearest;
  frame.shadows = options.shadows;
  frame.splats.lowPass = options.lowPass;
  return frame;
}

SurfelRenderer::SurfelRenderer(const std::filesystem::path& folder, const render::RendererOptions& options,
                               const Progress& progress)
    : SurfelRenderer(std::make_shared<const model::Model>(model::openModel(folder, progress)), options) {}

SurfelRenderer::SurfelRenderer(std::shared_ptr<const model::Model> model,
                               const render::RendererOptions& options)
    : model_(std::move(model)), full_(frameOptions(options)), knobs_(knobsOf(*model_, full_)),
      options_(full_), description_{model_->folder,
                                    identityOf(*model_, options_),
                                    {{"surfels", model_->cloud.size()}},
                                    model_->rig,
                                    model_->middle,
                                    model_->cloud.p0},
      workspace_(*model_, options.cacheBytes) {}

std::vector<knobs::Knob> SurfelRenderer::knobs() const {
  std::vector<knobs::Knob> knobs;
  for (const SurfelKnob& each : knobs_) knobs.push_back(each.knob);
  return knobs;
}

void SurfelRenderer::turn(const knobs::Setting& setting) {
  knobs::requireKnobs(knobs(), setting);
  options_ = turned(full_, knobs_, setting);
  description_.identity = identityOf(*model_, options_);
}

render::FrameLayers SurfelRenderer::render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                                           const Progress& progress, render::FrameLayers memory) {
  options_.aovs = aovs;
  workspace_.layers = std::move(memory);
  render::FrameLayers layers = renderFrame(*model_, scene, options_, workspace_, progress);
  const auto pixels = static_cast<size_t>(layers.color.width) * static_cast<size_t>(layers.color.height);
  layers.report = reportOf(workspace_.stats, options_, pixels);
  return layers;
}

render::EnvironmentReport SurfelRenderer::prepare(const scene::ShotEnvironment& environment,
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

} // namespace surflect::surfels
