#include "render/surfels/frame.h"

#include "render/surfels/aovs.h"
#include "render/surfels/queries.h"
#include "surfel/base/processor_time.h"
#include "warp/deform.h"

#include <algorithm>
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

image::Image develop(const splat::SplatRaster& raster, const shading::Shaded& shaded, image::Image memory) {
  static_assert(sizeof(Rgb) == 3 * sizeof(float));
  const std::span values(reinterpret_cast<const float*>(shaded.radiance.data()), 3 * shaded.radiance.size());
  return splat::blendWithAlpha(raster, values, 3, shaded.confidence, std::move(memory));
}

} // namespace

image::Image developRadiance(const splat::SplatRaster& raster, const shading::Shaded& shaded) {
  return develop(raster, shaded, {});
}

FrameLayers renderFrame(const shading::ReflectanceField& field, const scene::Scene& scene,
                        const FrameOptions& options, FrameWorkspace& workspace, const Progress& progress) {
  auto& [cache, environments, deformed, raster, memory, stats] = workspace;
  std::vector<const PreparedEnvironment*> prepared;
  for (const scene::ShotLight& light : scene.lights)
    if (const auto* environment = std::get_if<scene::ShotEnvironment>(&light))
      prepared.push_back(&environments.prepared(*environment, field, options.shade, progress));

  stats = {};
  stats.lights = scene.lights.size() - prepared.size();
  for (const PreparedEnvironment* environment : prepared) stats.lights += environment->lights.size();
  StageClock clock(stats);
  deformed = warp::deform(field.cloud, scene.warp, progress, std::move(deformed));
  clock.finish("warp");

  raster = splat::rasterize(scene.camera, splat::splatsOf(field.cloud, deformed), options.splats, progress,
                            std::move(raster));
  stats.splats = raster.counts;
  stats.visible = raster.visible.size();
  clock.finish("splat");

  const shading::FillBatch fill = [&](size_t begin, size_t end, shading::QueryBatch& batch) {
    const std::span surfels = std::span<const uint32_t>(raster.visible).subspan(begin, end - begin);
    writeQueries(field.cloud, deformed, surfels, scene.camera, scene.lights, prepared, progress, batch);
    clock.finish("queries");
  };
  shading::ShadeOptions shading = options.shade;
  shading.showsBlends = std::ranges::any_of(
      options.aovs, [](const std::string& aov) { return aov == "camera_blend" || aov == "light_blend"; });
  const shading::Shaded shaded =
      shading::shade(field, raster.visible.size(), fill, shading, cache, stats.shading, progress,
                     [&](double planning) { clock.finish("ulr", planning, "look-up"); });
  stats.unseen = shaded.unseen;

  FrameLayers layers = std::move(memory);
  layers.color = develop(raster, shaded, std::move(layers.color));
  clock.finish("develop");
  computeAovs(options.aovs, raster, deformed, shaded, progress, layers);
  if (!options.aovs.empty()) clock.finish("aov");
  return layers;
}

} // namespace surflect::surfels
