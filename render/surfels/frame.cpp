#include "render/surfels/frame.h"

#include "render/surfels/aovs.h"
#include "render/surfels/cast_shadows.h"
#include "render/surfels/cut.h"
#include "render/surfels/develop.h"
#include "render/surfels/frame_work.h"
#include "render/surfels/patch_corners.h"
#include "render/surfels/predicted_error.h"
#include "render/surfels/queries.h"
#include "warp/deform.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <numbers>

namespace surflect::surfels {

splat::SplatRaster look(const capture::Camera<ObjectSpace>& camera, const SurfelCloud& rest,
                        const DeformedCloud& deformed, const splat::SplatOptions& options,
                        const Progress& progress) {
  return splat::rasterize(camera, splat::splatsOf(rest, deformed), options, progress);
}

namespace {

constexpr size_t kMostStates = size_t{1} << 24; // shadow states in memory at a time, 4 bytes each

void countLights(const weights::ReflectanceField& field, const LitScene& lit, const FrameOptions& options,
                 FrameStats& stats) {
  stats.environments = lit.environments.size();
  stats.lights = lit.scene.lights.size() - lit.environments.size();
  if (weights::usesKriging(field, options.shade)) stats.pairLights = stats.lights;
  for (const PreparedEnvironment* environment : lit.environments)
    (environment->table ? stats.tabulatedLights : stats.lights) += environment->lights.size();
}

void countSplats(const splat::SplatRaster& raster, FrameStats& stats) {
  stats.splats = raster.counts;
  stats.visible = raster.visible.size();
  for (const splat::RasterTile& tile : raster.tiles)
    stats.covered += static_cast<size_t>(std::popcount(tile.blocks)) * splat::kLanes;
}

// Finds levels of detail and patches that the options need and the workspace lacks.
void prepareWorkspace(const weights::ReflectanceField& field, const FrameOptions& options,
                      size_t surfelsPerPatch, FrameWorkspace& workspace, const Progress& progress) {
  if (options.surfelSize > 0 && !workspace.levels)
    workspace.levels = cutLevels(
        field.cloud, field.levels ? *field.levels : levelsOfDetail(field.cloud, progress), progress);
  if (surfelsPerPatch > 1 && surfelsPerPatch != workspace.surfelsPerPatch) {
    workspace.patches = patchesOf(field.cloud, surfelsPerPatch);
    workspace.surfelsPerPatch = surfelsPerPatch;
  }
}

// Shadow states of surfels of a deformed cloud, those of one after the other.
std::vector<float> statesOf(const CastShadows& shadows, const DeformedCloud& deformed,
                            std::span<const uint32_t> surfels, const Progress& progress) {
  constexpr size_t kAtOnce = 1 << 14;
  std::vector<float> states;
  weights::QueryBatch part;
  for (size_t begin = 0; begin < surfels.size(); begin += kAtOnce) {
    progress.checkpoint();
    shadows.fill(deformed, surfels.subspan(begin, std::min(kAtOnce, surfels.size() - begin)), part);
    states.insert(states.end(), part.reached.begin(), part.reached.end());
  }
  return states;
}

// Appends the direction towards the viewer of each place of a batch.
void addDirections(const weights::QueryBatch& batch, std::vector<Direction3<AcquisitionSpace>>& directions) {
  for (size_t query = 0; query < batch.size(); ++query)
    directions.resize(directions.size() + batch.placeBegin(query + 1) - batch.placeBegin(query),
                      batch.towardsView[query]);
}

} // namespace

size_t surfelsPerCorner(const weights::ReflectanceField& field, const weights::ShadeOptions& options) {
  return weights::blendsCorners(field, options) && !weights::usesTables(field, options) ? 4 : 1;
}

DeformedCloud withTangents(Tangents tangents, const DeformedCloud& deformed,
                           const weights::ReflectanceField& field, std::span<const uint32_t> drawn) {
  if (tangents == Tangents::polar) return {};
  if (tangents == Tangents::bisector) return withBisectorFrames(deformed);
  assert(field.shared);
  const double fromFibre = tangents == Tangents::across ? std::numbers::pi / 2 : 0;
  std::vector<Angle> lines;
  for (uint32_t i = 0; i < deformed.size(); ++i) {
    const Angle fibre = field.shared->fibres[drawn.empty() ? i : drawn[i]];
    lines.push_back(Angle::fromRadians(fibre.radians() + fromFibre));
  }
  return withCarriedLines(deformed, lines);
}

FrameLayers renderFrame(const weights::ReflectanceField& field, const scene::Scene& requested,
                        const FrameOptions& options, FrameWorkspace& workspace, const Progress& progress) {
  auto& [cache, environments, deformed, raster, occluders, levels, cut, patches, surfelsPerPatch, memory,
         stats] = workspace;
  const LitScene lit =
      litScene(requested, options.environmentError, field, options.shade, environments, progress);
  const scene::Scene& scene = lit.scene;
  const bool isTranslucent = options.shade.usesAlpha && !field.alpha.empty();
  const bool mayBlend =
      !isTranslucent && lit.environments.empty() && weights::blendsCorners(field, options.shade);
  const size_t perQuery =
      options.surfelsPerQuery.value_or(mayBlend ? surfelsPerCorner(field, options.shade) : 1);
  prepareWorkspace(field, options, perQuery * (mayBlend ? 4 : 1), workspace, progress);
  stats = {};
  stats.cloud = field.cloud.size();
  countLights(field, lit, options, stats);
  StageClock clock(stats.seconds, stats.processorSeconds);

  if (options.surfelSize > 0)
    cut =
        cutFor(field.cloud, *levels, scene.warp, scene.camera, options.surfelSize, progress, std::move(cut));
  const bool isCut = options.surfelSize > 0 && !cut.isWhole;
  const SurfelCloud& cloud = isCut ? cut.cloud : field.cloud;
  stats.surfels = cloud.size();
  deformed = warp::deform(cloud, scene.warp, progress, std::move(deformed));
  clock.finish("warp");

  std::optional<CastShadows> shadows;
  if (castsShadows(field, options.shade, options.shadows) && stats.pairLights > 0) {
    if (!occluders) occluders = occludersOf(field.cloud, *field.levels);
    shadows.emplace(*occluders, field.cloud, scene, progress);
    stats.occluders = occluders->surfels.size();
    clock.finish("shadows");
  }

  splat::SplatOptions splatting = options.splats;
  splatting.keepsHidden = isTranslucent;
  raster = splat::rasterize(scene.camera, splat::splatsOf(cloud, deformed), splatting, progress,
                            std::move(raster));
  countSplats(raster, stats);
  clock.finish("splat");

  const DeformedCloud ofOptions =
      withTangents(options.tangents, deformed, field, isCut ? std::span(cut.surfels) : std::span<uint32_t>{});
  const DeformedCloud& tangents = options.tangents == Tangents::polar ? deformed : ofOptions;
  const std::span<const uint32_t> visible = raster.visible;
  // The shadow states of all visible surfels are held at a time where corners are blended.
  const bool blendsCorners = mayBlend && perQuery > 1 && visible.size() * stats.pairLights <= kMostStates;
  const bool sharesWeights = mayBlend ? blendsCorners : perQuery > 1;
  Patches ofCut;
  if (isCut && sharesWeights) ofCut = patchesIn(cut, patches);
  const Patches& patchesOfFrame = isCut ? ofCut : patches;
  std::vector<float> shadowStates;
  PatchCorners corners;
  PatchQueries middles;
  std::vector<uint32_t> cornerSurfels;
  if (blendsCorners) {
    if (shadows) shadowStates = statesOf(*shadows, deformed, visible, progress);
    corners = patchCorners(cloud, patchesOfFrame, visible, shadowStates, stats.pairLights);
    cornerSurfels = corners.surfels(visible);
  } else if (sharesWeights) {
    middles = patchQueries(patchesOfFrame, visible, deformed);
  }
  const std::span<const uint32_t> asking = blendsCorners   ? std::span<const uint32_t>(cornerSurfels)
                                           : sharesWeights ? std::span<const uint32_t>(middles.surfels)
                                                           : visible;
  stats.queries = asking.size();
  std::vector<Direction3<AcquisitionSpace>> towardsView; // of visible surfels, if the object is translucent
  // Queries of the given surfels, without shadow states and places.
  const auto writeAt = [&](std::span<const uint32_t> surfels, weights::QueryBatch& batch) {
    writeQueries(cloud, tangents, surfels, scene.camera, scene.lights, lit.environments, progress, batch);
    batch.reached.clear();
  };
  const auto numberInField = [&](weights::QueryBatch& batch) {
    if (isCut)
      for (std::vector<uint32_t>* surfels : {&batch.surfels, &batch.places})
        for (uint32_t& surfel : *surfels) surfel = cut.surfels[surfel];
  };
  const shading::FillBatch write = [&](size_t begin, size_t end, weights::QueryBatch& batch) {
    const auto surfels = asking.subspan(begin, end - begin);
    writeAt(surfels, batch);
    if (blendsCorners) {
      corners.addPlaces(visible, begin, end, batch);
      for (size_t corner = begin; shadows && corner < end; ++corner) {
        const auto states =
            std::span(shadowStates).subspan(corners.corners[corner] * stats.pairLights, stats.pairLights);
        batch.reached.insert(batch.reached.end(), states.begin(), states.end());
      }
    } else {
      if (shadows) shadows->fill(deformed, surfels, batch);
      if (sharesWeights) addPlaces(middles, visible, begin, end, batch);
    }
    numberInField(batch);
  };
  const shading::FillBatch fill = [&](size_t begin, size_t end, weights::QueryBatch& batch) {
    write(begin, end, batch);
    if (isTranslucent) addDirections(batch, towardsView);
    clock.finish("queries");
  };
  weights::ShadeOptions shading = options.shade;
  shading.placesPerQuery = sharesWeights ? perQuery : 1;
  shading.showsBlends = std::ranges::any_of(
      options.aovs, [](const std::string& aov) { return aov == "camera_blend" || aov == "light_blend"; });
  shading::Shaded shaded = shading::shade(field, asking.size(), fill, shading, cache, stats.shading, progress,
                                          [&](double planning) { clock.finish("ulr", planning, "look-up"); });
  stats.unseen = shaded.unseen;
  stats.unmatchedShadows = shaded.unmatchedShadows;

  const bool predictsError = std::ranges::count(options.aovs, "predicted_error") > 0;
  std::vector<float> gaps;
  if (predictsError) gaps = viewGaps(shaded.confidence);
  if (options.shade.interpolation == weights::Interpolation::paper) shaded.confidence.clear();
  FrameLayers layers = std::move(memory);
  const auto developed = [&](image::Image kept) {
    return isTranslucent ? developLayers(raster, cloud, towardsView, shaded, std::move(kept))
                         : developRadiance(raster, shaded, std::move(kept));
  };
  layers.color = developed(std::move(layers.color));
  clock.finish("develop");
  computeAovs(options.aovs, raster, deformed, shaded, progress, layers);
  if (predictsError) {
    shading.nearest = true;
    shading.showsBlends = false;
    shading.placesPerQuery = 1;
    const shading::FillBatch writeEach = [&](size_t begin, size_t end, weights::QueryBatch& batch) {
      writeAt(visible.subspan(begin, end - begin), batch);
      numberInField(batch);
    };
    shading::ShadingStats ofNearest;
    shading::Shaded nearest =
        shading::shade(field, visible.size(), writeEach, shading, cache, ofNearest, progress);
    shaded.radiance = std::move(nearest.radiance);
    shaded.alpha = std::move(nearest.alpha);
    layers.aovs["predicted_error"] = predictedError(
        layers.color, developed({}), splat::blend(raster, gaps, 1, shaded.confidence),
        options.errorModel.value_or(kFittedErrorModel), std::move(layers.aovs["predicted_error"]));
  }
  if (!options.aovs.empty()) clock.finish("aov");
  return layers;
}

} // namespace surflect::surfels
