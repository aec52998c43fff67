#include "render/surfels/frame.h"

#include "render/surfels/aovs.h"
#include "render/surfels/cast_shadows.h"
#include "render/surfels/cut.h"
#include "render/surfels/develop.h"
#include "render/surfels/frame_work.h"
#include "render/surfels/patch_corners.h"
#include "render/surfels/pixel_frame.h"
#include "render/surfels/predicted_error.h"
#include "render/surfels/queries.h"
#include "srf/shading/taps.h"
#include "surfel/base/text.h"
#include "warp/deform.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

namespace surflect::surfels {

splat::SplatRaster look(const capture::Camera<ObjectSpace>& camera, const SurfelCloud& rest,
                        const DeformedCloud& deformed, const splat::SplatOptions& options,
                        const Progress& progress) {
  return splat::rasterize(camera, splat::splatsOf(rest, deformed), options, progress);
}

namespace {

// Splats that cast shadows on the ground, whose edges are seen at the size of pixels.
constexpr size_t kMostGroundOccluders = size_t{1} << 18;
constexpr size_t kMostStates = size_t{1} << 24;      // shadow states in memory at a time, 4 bytes each
constexpr size_t kMostKeptAnswers = size_t{1} << 24; // 12 bytes each, and as many again during the frame
constexpr size_t kMostKeptLookUps = size_t{1} << 22; // of kept plans, 28 bytes each

void beginStats(const weights::ReflectanceField& field, const LitScene& lit, const FrameOptions& options,
                FrameStats& stats) {
  stats = {};
  stats.cloud = field.cloud.size();
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
                           const weights::ReflectanceField& field, std::span<const uint32_t> drawn,
                           const Progress& progress) {
  if (tangents == Tangents::polar) return {};
  if (tangents == Tangents::bisector) return withBisectorFrames(deformed, progress);
  assert(field.shared);
  const double fromFibre = tangents == Tangents::across ? std::numbers::pi / 2 : 0;
  std::vector<Angle> lines;
  for (uint32_t i = 0; i < deformed.size(); ++i) {
    progress.checkNowAndThen(i);
    const Angle fibre = field.shared->fibres[drawn.empty() ? i : drawn[i]];
    lines.push_back(Angle::fromRadians(fibre.radians() + fromFibre));
  }
  return withCarriedLines(deformed, lines, progress);
}

namespace {

bool isTranslucent(const weights::ReflectanceField& field, const FrameOptions& options) {
  return options.shade.usesAlpha && !field.alpha.empty();
}

// The surfels of a frame: warped and rasterised in the workspace, and ready to be asked for queries.
class PosedSurfels {
public:
  // The arguments must outlive this. The workspace has the levels of detail that the options need.
  PosedSurfels(const weights::ReflectanceField& field, const LitScene& lit, const FrameOptions& options,
               FrameWorkspace& workspace, StageClock& clock, const Progress& progress)
      : lit_(lit), workspace_(workspace), progress_(progress) {
    const scene::Scene& scene = lit.scene;
    FrameStats& stats = workspace.stats;
    KeptStages& kept = workspace.kept;
    const std::optional<RasterKey> before = std::exchange(kept.raster, std::nullopt);
    if (options.surfelSize > 0)
      workspace.cut = cutFor(field.cloud, *workspace.levels, scene.warp, scene.camera, options.surfelSize,
                             progress, std::move(workspace.cut));
    isCut_ = options.surfelSize > 0 && !workspace.cut.isWhole;
    cloud_ = isCut_ ? &workspace.cut.cloud : &field.cloud;
    stats.surfels = cloud().size();
    const bool isSameCloud = before && before->isCut == isCut_ && !(isCut_ && workspace.cut.isNew);
    const bool hasMoved = warp::deformInto(cloud(), scene.warp, progress, workspace.deformed);
    hasSameSurfels_ = workspace.keepsStages && isSameCloud && !hasMoved;
    clock.finish("warp");

    bool keepsShadows = false;
    if (castsShadows(field, options.shade, options.shadows) && stats.pairLights > 0) {
      if (!workspace.occluders) workspace.occluders = occludersOf(field.cloud, *field.levels);
      if (workspace.keepsStages) {
        if (!kept.occluders) kept.occluders.emplace(*workspace.occluders, field.cloud);
        keepsShadows = !kept.occluders->follow(scene.warp, progress);
        shadows_.emplace(*kept.occluders, scene);
        // States are kept from the second frame with the same occluders on.
        if (keepsShadows)
          shadows_->keepIn(kept.shadows, field.cloud.size(),
                           isCut_ ? std::span(workspace.cut.surfels) : std::span<const uint32_t>{});
        else
          kept.shadows.forget();
      } else {
        kept.forgetShadows();
        shadows_.emplace(*workspace.occluders, field.cloud, scene, progress);
      }
      stats.occluders = workspace.occluders->surfels.size();
      clock.finish("shadows");
    } else {
      kept.forgetShadows();
    }

    RasterKey key{scene.camera, options.splats, isCut_};
    key.splats.keepsHidden = isTranslucent(field, options);
    const bool isRasterOfLast = hasSameSurfels_ && before == key;
    if (!isRasterOfLast)
      workspace.raster = splat::rasterize(scene.camera, splat::splatsOf(cloud(), workspace.deformed),
                                          key.splats, progress, std::move(workspace.raster));
    kept.raster = key;
    hasSameRaster_ = isRasterOfLast && (keepsShadows || !shadows_);
    if (!hasSameRaster_) kept.clearAnswers();
    countSplats(workspace.raster, stats);
    clock.finish("splat");
    if (options.tangents != Tangents::polar)
      tangents_ = withTangents(options.tangents, workspace.deformed, field,
                               isCut_ ? std::span(workspace.cut.surfels) : std::span<uint32_t>{}, progress);
  }

  bool isCut() const { return isCut_; }
  // Whether the warped surfels are those of the last frame, in a workspace that keeps stages.
  bool hasSameSurfels() const { return hasSameSurfels_; }
  // Whether raster and shadows are those of the last frame, but for the lights of shadows.
  bool hasSameRaster() const { return hasSameRaster_; }
  const SurfelCloud& cloud() const { return *cloud_; } // of the field, or of the cut
  const std::optional<CastShadows>& shadows() const { return shadows_; }

  // Queries of surfels of the cloud for some lights, without shadow states and places.
  void write(std::span<const uint32_t> surfels, std::span<const scene::ShotLight> lights,
             weights::QueryBatch& batch) const {
    writeQueries(cloud(), tangents_ ? *tangents_ : workspace_.deformed, surfels, lit_.scene.camera, lights,
                 lit_.environments, progress_, batch);
    batch.reached.clear();
  }
  void write(std::span<const uint32_t> surfels, weights::QueryBatch& batch) const {
    write(surfels, lit_.scene.lights, batch);
  }
  // Names the surfels of a batch by their numbers in the field.
  void numberInField(weights::QueryBatch& batch) const {
    if (!isCut_) return;
    for (std::vector<uint32_t>* surfels : {&batch.surfels, &batch.places})
      for (uint32_t& surfel : *surfels) surfel = workspace_.cut.surfels[surfel];
  }

private:
  const LitScene& lit_;
  const FrameWorkspace& workspace_;
  const Progress& progress_;
  bool isCut_ = false, hasSameSurfels_ = false, hasSameRaster_ = false;
  const SurfelCloud* cloud_ = nullptr;
  std::optional<CastShadows> shadows_;    // of lights that are weighted by pairs
  std::optional<DeformedCloud> tangents_; // for L, unless they are those of the deformed cloud
};

// Shaded surfels, and the surfels of the queries whose weights they take.
struct Askers {
  std::span<const uint32_t> places;      // shaded surfels
  std::span<const uint32_t> surfels;     // of the queries
  const PatchCorners* corners = nullptr; // if corners are blended
  const PatchQueries* middles = nullptr; // if patches share weights
  std::span<const float> states;         // with corners: shadow states, #lights for each place
};

// Keeps some of the `all` columns of a matrix that is stored row by row.
void keepColumns(std::span<const uint32_t> columns, size_t all, std::vector<float>& matrix) {
  const size_t rows = matrix.size() / all;
  for (size_t row = 0; row < rows; ++row)
    for (size_t k = 0; k < columns.size(); ++k)
      matrix[row * columns.size() + k] = matrix[row * all + columns[k]];
  matrix.resize(rows * columns.size());
}

// Colour and AOVs of a frame by splats.
FrameLayers renderSplats(const weights::ReflectanceField& field, const LitScene& lit,
                         const FrameOptions& options, FrameWorkspace& workspace, StageClock& clock,
                         const Progress& progress) {
  FrameStats& stats = workspace.stats;
  KeptStages& kept = workspace.kept;
  const bool showsLayers = isTranslucent(field, options);
  const bool mayBlend =
      !showsLayers && lit.environments.empty() && weights::blendsCorners(field, options.shade);
  const size_t perQuery =
      options.surfelsPerQuery.value_or(mayBlend ? surfelsPerCorner(field, options.shade) : 1);
  prepareWorkspace(field, options, perQuery * (mayBlend ? 4 : 1), workspace, progress);
  const PosedSurfels posed(field, lit, options, workspace, clock, progress);
  const SurfelCloud& cloud = posed.cloud();
  const DeformedCloud& deformed = workspace.deformed;
  const splat::SplatRaster& raster = workspace.raster;
  const std::optional<CastShadows>& shadows = posed.shadows();
  const std::span<const uint32_t> visible = raster.visible;
  // The shadow states of all visible surfels are held at a time where corners are blended.
  const bool blendsCorners = mayBlend && perQuery > 1 && visible.size() * stats.pairLights <= kMostStates;
  const bool sharesWeights = mayBlend ? blendsCorners : perQuery > 1;
  Patches ofCut;
  if (posed.isCut() && sharesWeights) ofCut = patchesIn(workspace.cut, workspace.patches);
  const Patches& patchesOfFrame = posed.isCut() ? ofCut : workspace.patches;
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
  const Askers askers = blendsCorners   ? Askers{visible, cornerSurfels, &corners, nullptr, shadowStates}
                        : sharesWeights ? Askers{visible, middles.surfels, nullptr, &middles, {}}
                                        : Askers{visible, visible, nullptr, nullptr, {}};
  std::vector<Direction3<AcquisitionSpace>> towardsView; // of visible surfels, if the object is translucent
  weights::ShadeOptions shading = options.shade;
  shading.placesPerQuery = sharesWeights ? perQuery : 1;
  shading.showsBlends = std::ranges::any_of(
      options.aovs, [](const std::string& aov) { return aov == "camera_blend" || aov == "light_blend"; });
  // Shades surfels under lights of the scene, named by their numbers.
  const auto shadeUnder = [&](const Askers& all, std::span<const uint32_t> numbers,
                              const shading::Kept& keeping) {
    std::vector<scene::ShotLight> lights;
    for (const uint32_t number : numbers) lights.push_back(lit.scene.lights[number]);
    const shading::FillBatch fill = [&](size_t begin, size_t end, weights::QueryBatch& batch) {
      const auto surfels = all.surfels.subspan(begin, end - begin);
      posed.write(surfels, lights, batch);
      if (all.corners) {
        all.corners->addPlaces(all.places, begin, end, batch);
        for (size_t corner = begin; shadows && corner < end; ++corner)
          for (const uint32_t number : numbers)
            batch.reached.push_back(all.states[all.corners->corners[corner] * stats.pairLights + number]);
      } else {
        if (shadows) shadows->fill(deformed, surfels, batch);
        if (numbers.size() < stats.pairLights) keepColumns(numbers, stats.pairLights, batch.reached);
        if (all.middles) addPlaces(*all.middles, all.places, begin, end, batch);
      }
      posed.numberInField(batch);
      if (showsLayers) addDirections(batch, towardsView);
      clock.finish("queries");
    };
    stats.queries += all.surfels.size();
    return shading::shade(
        field, all.surfels.size(), fill, shading, workspace.cache, stats.shading, progress,
        [&](double planning) { clock.finish("ulr", planning, "look-up"); }, keeping);
  };
  const QueryKey key{shading,
                     options.tangents,
                     perQuery,
                     blendsCorners,
                     shadows.has_value(),
                     lit.scene.lights.size(),
                     lit.environments.size()};
  const std::vector<uint32_t> every = upTo(lit.scene.lights.size());
  const size_t targetsPerLight = weights::usesTables(field, options.shade) ? 2 : 1;
  const bool keepsAnswers = workspace.keepsStages && mayBlend && !shading.showsBlends && every.size() > 1 &&
                            visible.size() * every.size() * targetsPerLight <= kMostKeptAnswers;
  // Stages kept for the other way to weight photographs make room.
  if (keepsAnswers)
    kept.lookUps = {}, kept.plans = {};
  else
    kept.answers.clear();
  shading::Shaded shaded;
  if (keepsAnswers) {
    shading.showsTargets = true;
    const auto missing = kept.answers.missing(key, lit.scene.lights, corners);
    kept.answers.begin(every.size(), visible.size(), targetsPerLight);
    shaded = shadeUnder(askers, missing.lights, {.places = visible.size()});
    kept.answers.take(shaded, missing.lights, upTo(visible.size()));
    shaded.targets = {}; // which the answers hold
    if (!missing.groups.empty()) {
      std::vector<uint32_t> places;
      const PatchCorners some = someGroups(corners, missing.groups, places);
      std::vector<uint32_t> surfels;
      std::vector<float> states;
      for (const uint32_t place : places) {
        surfels.push_back(visible[place]);
        for (size_t l = 0; shadows && l < every.size(); ++l)
          states.push_back(shadowStates[place * every.size() + l]);
      }
      const std::vector<uint32_t> asking = some.surfels(surfels);
      kept.answers.take(
          shadeUnder({surfels, asking, &some, nullptr, states}, missing.others, {.places = places.size()}),
          missing.others, places);
    }
    shaded.radiance = kept.answers.radiance();
    stats.unmatchedShadows = kept.answers.unmatchedShadows();
    kept.answers.finish(key, lit.scene.lights, std::move(corners));
    shading.showsTargets = false;
  } else {
    // Kept once a second frame has the same raster, or the same warped surfels and lights.
    const bool keepsPlans = workspace.keepsStages && posed.hasSameRaster() &&
                            visible.size() * options.shade.cameras <= kMostKeptLookUps;
    const bool keepsLookUps = posed.hasSameSurfels() && !keepsPlans && !shading.showsBlends &&
                              lit.environments.empty() && !every.empty() &&
                              std::ranges::equal(kept.lights, lit.scene.lights, isSameLight);
    if (!keepsPlans || kept.plansKey != key) kept.plans = {};
    kept.plansKey = key;
    shaded = shadeUnder(askers, every,
                        {keepsPlans ? &kept.plans : nullptr, keepsLookUps ? &kept.lookUps : nullptr, 0});
    stats.unmatchedShadows = shaded.unmatchedShadows;
  }
  stats.unseen = shaded.unseen;
  kept.lights = lit.scene.lights;

  const bool predictsError = std::ranges::count(options.aovs, "predicted_error") > 0;
  std::vector<float> gaps;
  if (predictsError) gaps = viewGaps(shaded.confidence);
  if (options.shade.interpolation == weights::Interpolation::paper) shaded.confidence.clear();
  FrameLayers layers = std::move(workspace.layers);
  const auto developed = [&](image::Image memory) {
    return showsLayers ? developLayers(raster, cloud, towardsView, shaded, std::move(memory), progress)
                       : developRadiance(raster, shaded, std::move(memory), progress);
  };
  layers.color = developed(std::move(layers.color));
  clock.finish("develop");
  computeAovs(options.aovs, raster, cloud, deformed, shaded, progress, layers);
  if (predictsError) {
    shading.nearest = true;
    shading.showsBlends = false;
    shading.placesPerQuery = 1;
    const shading::FillBatch writeEach = [&](size_t begin, size_t end, weights::QueryBatch& batch) {
      posed.write(visible.subspan(begin, end - begin), batch);
      posed.numberInField(batch);
    };
    shading::ShadingStats ofNearest;
    shading::Shaded nearest =
        shading::shade(field, visible.size(), writeEach, shading, workspace.cache, ofNearest, progress);
    shaded.radiance = std::move(nearest.radiance);
    shaded.alpha = std::move(nearest.alpha);
    layers.aovs["predicted_error"] = predictedError(
        layers.color, developed({}), splat::blend(raster, gaps, 1, shaded.confidence, {}, progress),
        options.errorModel.value_or(kFittedErrorModel), std::move(layers.aovs["predicted_error"]), progress);
  }
  if (!options.aovs.empty()) clock.finish("aov");
  return layers;
}

} // namespace

FrameLayers renderFrame(const weights::ReflectanceField& field, const scene::Scene& requested,
                        const FrameOptions& options, FrameWorkspace& workspace, const Progress& progress) {
  FrameStats& stats = workspace.stats;
  const LitScene lit =
      litScene(requested, options.environmentError, field, options.shade, workspace.environments, progress);
  beginStats(field, lit, options, stats);
  StageClock clock(stats.seconds, stats.processorSeconds);
  FrameLayers layers = field.grid ? renderPixels(field, lit, options, workspace, clock, progress)
                                  : renderSplats(field, lit, options, workspace, clock, progress);
  layers.shadow = {};
  if (requested.ground && requested.ground->shadow == 0) {
    layers.shadow = image::Image(layers.color.width, layers.color.height, 1);
  } else if (requested.ground) {
    if (!workspace.finer)
      workspace.finer =
          occludersOf(field.cloud, field.levels ? *field.levels : levelsOfDetail(field.cloud, progress),
                      kMostGroundOccluders);
    const GroundShadow shadow(*workspace.finer, field.cloud, requested, workspace.groundLights, progress);
    layers.shadow = shadowBehind(layers.color, shadow.picture(progress), requested.ground->shadow);
    clock.finish("ground");
  }
  return layers;
}

namespace {

// Photographs of a plan of one place.
method::PhotographBlend blendOf(const weights::ReflectanceField& field, const shading::ShadingPlan& plan,
                                size_t sources) {
  const auto isShown = [&](const shading::ShadingOp& op) { // else the queue drops it
    return field.files.empty() || shading::storesTexel(field.files[op.view], op.x, op.y);
  };
  const bool anyIsShown = std::ranges::any_of(plan.ops, isShown);
  using ViewAndLight = std::pair<uint32_t, std::optional<uint32_t>>;
  std::map<ViewAndLight, method::BlendedPhotograph> blended;
  double sum = 0;
  for (const shading::ShadingOp& op : plan.ops) {
    if (anyIsShown && !isShown(op)) continue;
    for (uint32_t l = op.rowBegin; l < op.rowEnd; ++l) {
      const auto& [color, begin, end] = plan.rows.lights[l];
      for (const auto& [column, ofLight] : std::span(plan.rows.weights).subspan(begin, end - begin)) {
        const double weight = std::abs(double{op.weight} * ofLight * weights::brightness(color));
        if (!(weight > 0)) continue;
        std::optional<uint32_t> light;
        if (!field.rig.lights.empty()) light = field.columns[op.view][column];
        method::BlendedPhotograph& photograph = blended[{op.view, light}];
        photograph.view = field.rig.views[op.view].identity;
        if (light) photograph.light = field.rig.lights[*light].identity;
        photograph.weight += weight;
        photograph.place = {op.x, op.y};
        sum += weight;
      }
    }
  }
  method::PhotographBlend blend;
  for (auto& [_, photograph] : blended) {
    photograph.weight /= sum;
    blend.photographs.push_back(std::move(photograph));
  }
  std::ranges::stable_sort(blend.photographs, std::greater(), &method::BlendedPhotograph::weight);
  for (const float share : plan.tableShares) blend.tables += share / static_cast<double>(sources);
  return blend;
}

} // namespace

method::PhotographBlend blendedAt(const weights::ReflectanceField& field, const scene::Scene& scene,
                                  capture::Pixel pixel, const FrameOptions& options,
                                  FrameWorkspace& workspace, const Progress& progress) {
  if (!capture::contains(scene.camera.lens, pixel)) return {};
  const LitScene lit =
      litScene(scene, options.environmentError, field, options.shade, workspace.environments, progress);
  prepareWorkspace(field, options, 1, workspace, progress);
  beginStats(field, lit, options, workspace.stats);
  StageClock clock(workspace.stats.seconds, workspace.stats.processorSeconds);
  const PosedSurfels posed(field, lit, options, workspace, clock, progress);
  const auto surfel =
      splat::heaviestSplat(workspace.raster, static_cast<int>(pixel.x), static_cast<int>(pixel.y));
  if (!surfel) return {};
  weights::QueryBatch batch;
  posed.write(std::span(&*surfel, 1), batch);
  if (posed.shadows()) posed.shadows()->fill(workspace.deformed, std::span(&*surfel, 1), batch);
  posed.numberInField(batch);
  return blendOf(field, shading::planShading(field, batch, options.shade), batch.sources());
}

} // namespace surflect::surfels
