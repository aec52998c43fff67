#include "render/surfels/frame.h"

#include "render/surfels/aovs.h"
#include "render/surfels/cast_shadows.h"
#include "render/surfels/fitted_error_model.h"
#include "render/surfels/predicted_error.h"
#include "render/surfels/queries.h"
#include "render/surfels/translucent_layers.h"
#include "surfel/base/processor_time.h"
#include "warp/deform.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>

namespace surflect::surfels {

namespace {

class StageClock {
public:
  explicit StageClock(FrameStats& stats) : stats_(stats) {}
  // Adds the time since the last call to a stage.
  void finish(const std::string& stage) { finish(stage, 1, stage); }
  // Adds `share` of the time since the last call to `stage`, and the remainder to the stage `rest`.
  void finish(const std::string& stage, double share, const std::string& rest) {
    const auto now = std::chrono::steady_clock::now();
    const double processor = processorSeconds();
    const double passed = std::chrono::duration<double>(now - last_).count();
    const double used = processor - lastProcessor_;
    stats_.seconds[stage] += share * passed;
    stats_.processorSeconds[stage] += share * used;
    stats_.seconds[rest] += (1 - share) * passed;
    stats_.processorSeconds[rest] += (1 - share) * used;
    last_ = now;
    lastProcessor_ = processor;
  }

private:
  FrameStats& stats_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  double lastProcessor_ = processorSeconds();
};

} // namespace

splat::SplatRaster look(const capture::Camera<ObjectSpace>& camera, const SurfelCloud& rest,
                        const DeformedCloud& deformed, const splat::SplatOptions& options,
                        const Progress& progress) {
  return splat::rasterize(camera, splat::splatsOf(rest, deformed), options, progress);
}

namespace {

// Radiance and alpha of each visible surfel.
std::vector<float> premultiplied(const shading::Shaded& shaded) {
  std::vector<float> values(4 * shaded.radiance.size());
  for (size_t i = 0; i < shaded.radiance.size(); ++i) {
    const Rgb& color = shaded.radiance[i];
    std::ranges::copy(std::array{color.r, color.g, color.b, shaded.alpha[i]}, &values[4 * i]);
  }
  return values;
}

image::Image develop(const splat::SplatRaster& raster, const shading::Shaded& shaded, image::Image memory) {
  if (!shaded.alpha.empty())
    return splat::blend(raster, premultiplied(shaded), 4, shaded.confidence, std::move(memory));
  static_assert(sizeof(Rgb) == 3 * sizeof(float));
  const std::span values(reinterpret_cast<const float*>(shaded.radiance.data()), 3 * shaded.radiance.size());
  return splat::blendWithAlpha(raster, values, 3, shaded.confidence, std::move(memory));
}

// Develops a translucent object. towardsView: of each visible surfel, in which its photographs were looked
// up.
image::Image developLayers(const splat::SplatRaster& raster, const SurfelCloud& cloud,
                           std::span<const Direction3<AcquisitionSpace>> towardsView,
                           const shading::Shaded& shaded, image::Image memory) {
  constexpr float kClearance = 4; // radii of a splat
  std::vector<Point3<AcquisitionSpace>> p0;
  std::vector<float> clearance;
  for (const uint32_t surfel : raster.visible) {
    p0.push_back(cloud.p0[surfel]);
    clearance.push_back(kClearance * cloud.radius[surfel]);
  }
  return compositeLayers(raster, premultiplied(shaded), shaded.confidence, {p0, towardsView, clearance},
                         std::move(memory));
}

} // namespace

image::Image developRadiance(const splat::SplatRaster& raster, const shading::Shaded& shaded) {
  return develop(raster, shaded, {});
}

namespace {

// Queries for the patches of which a surfel is visible. Surfels are those of the drawn cloud.
struct PatchQueries {
  std::vector<uint32_t> surfels;    // one per query: the patch's middle, or a visible surfel if that is dead
  std::vector<uint32_t> firstPlace; // of each query in the list of visible surfels, then its length
};

// visible: ascending.
PatchQueries queriesOf(const Patches& patches, std::span<const uint32_t> visible,
                       const DeformedCloud& deformed) {
  PatchQueries queries;
  size_t next = 0; // patch after the last one that was asked
  for (uint32_t place = 0; place < visible.size(); ++place) {
    if (visible[place] < patches.first[next]) continue;
    while (patches.first[next] <= visible[place]) ++next;
    const uint32_t middle = patches.middle[next - 1];
    queries.surfels.push_back(deformed.handedness[middle] == Handedness::dead ? visible[place] : middle);
    queries.firstPlace.push_back(place);
  }
  queries.firstPlace.push_back(static_cast<uint32_t>(visible.size()));
  return queries;
}

// Adds the places of the queries [begin, end) to a batch.
void addPlaces(const PatchQueries& queries, std::span<const uint32_t> visible, size_t begin, size_t end,
               shading::QueryBatch& batch) {
  const uint32_t first = queries.firstPlace[begin], last = queries.firstPlace[end];
  batch.places.assign(visible.begin() + first, visible.begin() + last);
  batch.firstPlace.clear();
  for (size_t query = begin; query <= end; ++query)
    batch.firstPlace.push_back(queries.firstPlace[query] - first);
}

// Appends the direction towards the viewer of each place of a batch.
void addDirections(const shading::QueryBatch& batch, std::vector<Direction3<AcquisitionSpace>>& directions) {
  for (size_t query = 0; query < batch.size(); ++query)
    directions.resize(directions.size() + batch.placeBegin(query + 1) - batch.placeBegin(query),
                      batch.towardsView[query]);
}

// The pieces of patches that a cut has left; their middle is the middle surfel of the run.
Patches patchesIn(const Cut& cut, const Patches& whole) {
  Patches patches;
  size_t next = 0; // patch of the whole cloud after the last one that has a piece
  for (uint32_t i = 0; i < cut.surfels.size(); ++i) {
    if (cut.surfels[i] < whole.first[next]) continue;
    while (whole.first[next] <= cut.surfels[i]) ++next;
    patches.first.push_back(i);
  }
  patches.first.push_back(static_cast<uint32_t>(cut.surfels.size()));
  for (size_t patch = 0; patch + 1 < patches.first.size(); ++patch)
    patches.middle.push_back((patches.first[patch] + patches.first[patch + 1]) / 2);
  return patches;
}

} // namespace

FrameLayers renderFrame(const shading::ReflectanceField& field, const scene::Scene& scene,
                        const FrameOptions& options, FrameWorkspace& workspace, const Progress& progress) {
  auto& [cache, environments, deformed, raster, occluders, levels, cut, patches, surfelsPerPatch, memory,
         stats] = workspace;
  std::vector<const PreparedEnvironment*> prepared;
  for (const scene::ShotLight& light : scene.lights)
    if (const auto* environment = std::get_if<scene::ShotEnvironment>(&light))
      prepared.push_back(&environments.prepared(coarsened(*environment, options.environmentError), field,
                                                options.shade, progress));
  const bool sharesWeights = options.surfelsPerPatch > 1;
  if (options.surfelSize > 0 && !levels)
    levels = cutLevels(field.cloud, field.levels ? *field.levels : levelsOfDetail(field.cloud, progress),
                       progress);
  if (sharesWeights && options.surfelsPerPatch != surfelsPerPatch) {
    patches = patchesOf(field.cloud, options.surfelsPerPatch);
    surfelsPerPatch = options.surfelsPerPatch;
  }

  stats = {};
  stats.cloud = field.cloud.size();
  stats.environments = prepared.size();
  stats.lights = scene.lights.size() - prepared.size();
  for (const PreparedEnvironment* environment : prepared)
    (environment->table ? stats.tabulatedLights : stats.lights) += environment->lights.size();
  if (shading::weighsPairs(field, options.shade)) stats.pairLights = scene.lights.size() - prepared.size();
  StageClock clock(stats);
  if (options.surfelSize > 0)
    cut =
        cutFor(field.cloud, *levels, scene.warp, scene.camera, options.surfelSize, progress, std::move(cut));
  const bool isCut = options.surfelSize > 0 && !cut.isWhole;
  const SurfelCloud& cloud = isCut ? cut.cloud : field.cloud;
  stats.surfels = cloud.size();
  deformed = warp::deform(cloud, scene.warp, progress, std::move(deformed));
  clock.finish("warp");

  std::optional<CastShadows> shadows;
  if (options.shadows.value_or(field.interpolation.shadows) && stats.pairLights > 0 &&
      field.lightVisibility && field.levels) {
    if (!occluders) occluders = occludersOf(field.cloud, *field.levels);
    shadows.emplace(*occluders, field.cloud, scene, progress);
    stats.occluders = occluders->surfels.size();
    clock.finish("shadows");
  }

  const bool isTranslucent = options.shade.usesAlpha && !field.alpha.empty();
  splat::SplatOptions splatting = options.splats;
  splatting.keepsHidden = isTranslucent;
  raster = splat::rasterize(scene.camera, splat::splatsOf(cloud, deformed), splatting, progress,
                            std::move(raster));
  stats.splats = raster.counts;
  stats.visible = raster.visible.size();
  for (const splat::RasterTile& tile : raster.tiles)
    stats.covered += static_cast<size_t>(std::popcount(tile.blocks)) * splat::kLanes;
  clock.finish("splat");

  const std::span<const uint32_t> visible = raster.visible;
  const PatchQueries queries = sharesWeights
                                   ? queriesOf(isCut ? patchesIn(cut, patches) : patches, visible, deformed)
                                   : PatchQueries{};
  const std::span<const uint32_t> asking = sharesWeights ? std::span(queries.surfels) : visible;
  stats.queries = asking.size();
  std::vector<Direction3<AcquisitionSpace>> towardsView; // of visible surfels, if the object is translucent
  const shading::FillBatch write = [&](size_t begin, size_t end, shading::QueryBatch& batch) {
    writeQueries(cloud, deformed, asking.subspan(begin, end - begin), scene.camera, scene.lights, prepared,
                 progress, batch);
    batch.reached.clear();
    if (shadows) shadows->fill(deformed, asking.subspan(begin, end - begin), batch);
    if (sharesWeights) addPlaces(queries, visible, begin, end, batch);
    if (isCut)
      for (std::vector<uint32_t>* surfels : {&batch.surfels, &batch.places})
        for (uint32_t& surfel : *surfels) surfel = cut.surfels[surfel];
  };
  const shading::FillBatch fill = [&](size_t begin, size_t end, shading::QueryBatch& batch) {
    write(begin, end, batch);
    if (isTranslucent) addDirections(batch, towardsView);
    clock.finish("queries");
  };
  shading::ShadeOptions shading = options.shade;
  shading.placesPerQuery = options.surfelsPerPatch;
  shading.showsBlends = std::ranges::any_of(
      options.aovs, [](const std::string& aov) { return aov == "camera_blend" || aov == "light_blend"; });
  shading::Shaded shaded = shading::shade(field, asking.size(), fill, shading, cache, stats.shading, progress,
                                          [&](double planning) { clock.finish("ulr", planning, "look-up"); });
  stats.unseen = shaded.unseen;
  stats.unmatchedShadows = shaded.unmatchedShadows;

  const bool predictsError = std::ranges::count(options.aovs, "confidence") > 0;
  std::vector<float> gaps;
  if (predictsError) gaps = viewGaps(shaded.confidence);
  if (options.shade.interpolation == shading::Interpolation::paper) shaded.confidence.clear();
  FrameLayers layers = std::move(memory);
  const auto developed = [&](image::Image kept) {
    return isTranslucent ? developLayers(raster, cloud, towardsView, shaded, std::move(kept))
                         : develop(raster, shaded, std::move(kept));
  };
  layers.color = developed(std::move(layers.color));
  clock.finish("develop");
  computeAovs(options.aovs, raster, deformed, shaded, progress, layers);
  if (predictsError) {
    shading.nearest = true;
    shading.showsBlends = false;
    shading::ShadingStats ofNearest;
    shading::Shaded nearest =
        shading::shade(field, asking.size(), write, shading, cache, ofNearest, progress);
    shaded.radiance = std::move(nearest.radiance);
    shaded.alpha = std::move(nearest.alpha);
    layers.aovs["confidence"] =
        predictedError(layers.color, developed({}), splat::blend(raster, gaps, 1, shaded.confidence),
                       options.errorModel.value_or(kFittedErrorModel), std::move(layers.aovs["confidence"]));
  }
  if (!options.aovs.empty()) clock.finish("aov");
  return layers;
}

} // namespace surflect::surfels
