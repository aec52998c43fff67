#include "render/frame.h"

#include "surfel/processor_time.h"
#include "warp/deform.h"

#include <tbb/parallel_for.h>

#include <cassert>
#include <chrono>
#include <functional>

namespace surflect {

namespace {

class StageClock {
public:
  explicit StageClock(FrameStats& stats) : stats_(stats) {}
  // Credits the time since the last call to a stage.
  void finish(const std::string& stage) {
    const auto now = std::chrono::steady_clock::now();
    const double processor = processorSeconds();
    stats_.seconds[stage] += std::chrono::duration<double>(now - last_).count();
    stats_.processorSeconds[stage] += processor - lastProcessor_;
    last_ = now;
    lastProcessor_ = processor;
  }

private:
  FrameStats& stats_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  double lastProcessor_ = processorSeconds();
};

// What a light does at a point of object space.
struct Incidence {
  Direction3<ObjectSpace, double> towards; // unit
  Rgb irradiance;
};
Incidence incidenceAt(const ShotLight& light, const Point3<ObjectSpace, double>& p) {
  if (const auto* directional = std::get_if<ShotDirectionalLight>(&light))
    return {directional->towards, directional->irradiance};
  const auto& point = std::get<ShotPointLight>(light); // environments have no one direction
  const auto toLight = point.position - p;
  const double squared = dot(toLight, toLight);
  if (!(squared > 0)) return {{0, 0, 1}, {}}; // the light sits on the surfel
  return {normalized(toLight), static_cast<float>(1 / squared) * point.intensity}; // A(|p* - p_l|) = 1 / d^2
}

Uncovered uncoveredOf(const ShotLight& light) {
  if (const auto* directional = std::get_if<ShotDirectionalLight>(&light)) return directional->uncovered;
  return std::get<ShotPointLight>(light).uncovered;
}

QueryEnvironment queryOf(const ShotEnvironment& light) {
  const PreparedEnvironment& environment = *light.environment;
  return {environment.lights, light.strength, environment.uncovered,
          environment.table ? &*environment.table : nullptr};
}

template <class ValueOf> Image developEach(const Sight& sight, int channels, const ValueOf& valueOf) {
  std::vector<float> values;
  for (size_t i = 0; i < sight.surfels.size(); ++i)
    for (const double value : valueOf(i)) values.push_back(static_cast<float>(value));
  return develop(sight, values, channels);
}

} // namespace

double stretchOf(const Vec3<double>& u, const Vec3<double>& v) {
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double mean = (uu + vv) / 2, spread = std::hypot((uu - vv) / 2, uv);
  const double smaller = u.cross(v).squaredNorm() / (mean + spread); // product over the larger root
  return std::sqrt((mean + spread) / smaller);
}

Sight look(const Camera<ObjectSpace>& camera, const SurfelCloud& rest, const DeformedCloud& deformed,
           const SplatOptions& options, const Progress& progress) {
  Sight sight;
  sight.coverage = cover(camera, splatsOf(rest, deformed), options, progress);
  sight.surfels = sight.coverage.visible;
  return sight;
}

LookUp<double> lookUpAt(const SurfelCloud& rest, const DeformedCloud& deformed, size_t surfel) {
  const auto frame =
      polarFrame<double>(deformed.u[surfel].raw().cast<double>(), deformed.v[surfel].raw().cast<double>());
  assert(frame && deformed.handedness[surfel] != Handedness::dead);
  return {rotationOf<double>(rest.r0[surfel]), *frame, static_cast<double>(deformed.handedness[surfel])};
}

QueryBatch queriesAt(const SurfelCloud& rest, const DeformedCloud& deformed,
                     std::span<const uint32_t> surfels, const Camera<ObjectSpace>& camera,
                     std::span<const ShotLight> lights, const Progress& progress) {
  const Viewpoint viewpoint(camera);
  QueryBatch batch;
  std::vector<const ShotLight*> single; // from one direction at a surfel
  std::vector<const ShotEnvironment*> environments;
  for (const ShotLight& light : lights) {
    if (const auto* environment = std::get_if<ShotEnvironment>(&light)) {
      environments.push_back(environment);
      batch.environments.push_back(queryOf(*environment));
    } else {
      single.push_back(&light);
      batch.uncovered.push_back(uncoveredOf(light));
    }
  }
  batch.lights = single.size();
  batch.surfels.assign(surfels.begin(), surfels.end());
  batch.towardsView.resize(surfels.size());
  batch.towardsLight.resize(surfels.size() * single.size());
  batch.irradiance.resize(surfels.size() * single.size());
  batch.acquisitionFromEnvironment.resize(surfels.size() * environments.size());
  tbb::parallel_for(size_t{0}, surfels.size(), [&](size_t query) {
    if (query % 1024 == 0) progress.checkpoint();
    const size_t surfel = surfels[query];
    const LookUp<double> lookUp = lookUpAt(rest, deformed, surfel);
    const auto p = deformed.p[surfel].cast<double>();
    batch.towardsView[query] = lookUp(viewpoint.towards(p)).cast<float>();
    for (size_t l = 0; l < single.size(); ++l) {
      const Incidence incidence = incidenceAt(*single[l], p);
      batch.towardsLight[query * single.size() + l] = lookUp(incidence.towards).cast<float>();
      batch.irradiance[query * single.size() + l] = incidence.irradiance;
    }
    const Turn<AcquisitionSpace, ObjectSpace> acquisitionFromObject(lookUp.matrix());
    for (size_t e = 0; e < environments.size(); ++e)
      batch.acquisitionFromEnvironment[query * environments.size() + e] =
          (acquisitionFromObject * environments[e]->objectFromEnvironment).cast<float>();
  });
  return batch;
}

Image develop(const Sight& sight, std::span<const float> values, int channels) {
  return blend(sight.coverage, values, channels);
}

Image developRadiance(const Sight& sight, std::span<const Rgb> radiance) {
  static_assert(sizeof(Rgb) == 3 * sizeof(float));
  const std::span values(reinterpret_cast<const float*>(radiance.data()), 3 * radiance.size());
  return blendWithAlpha(sight.coverage, values, 3);
}

Film renderFrame(const Model& model, const Warp& warp, const Camera<ObjectSpace>& camera,
                 std::span<const ShotLight> lights, const FrameOptions& options, BlockCache& cache,
                 FrameStats& stats, const Progress& progress) {
  StageClock clock(stats);
  const DeformedCloud deformed = deform(model.cloud, warp, progress);
  clock.finish("warp");
  const Sight sight = look(camera, model.cloud, deformed, options.splats, progress);
  stats.splats = sight.coverage.counts;
  stats.visible = sight.surfels.size();
  clock.finish("splat");
  const QueryBatch batch = queriesAt(model.cloud, deformed, sight.surfels, camera, lights, progress);
  clock.finish("look-up");
  const Shaded shaded = shade(model, batch, options.shade, cache, stats.shading, progress,
                              [&](std::string_view stage) { clock.finish(std::string(stage)); });
  stats.unseen = shaded.unseen;

  Film film;
  film.color = developRadiance(sight, shaded.radiance);
  const auto rgbOf = [](Rgb c) { return std::array<double, 3>{c.r, c.g, c.b}; };
  const std::map<std::string_view, std::function<Image()>> layers{
      {"depth", [&] { return depthImage(sight.coverage); }},
      {"normal",
       [&] {
         return developEach(sight, 3, [&](size_t i) {
           return lookUpAt(model.cloud, deformed, sight.surfels[i]).outwardNormal().raw();
         });
       }},
      {"camera_blend",
       [&] { return developEach(sight, 3, [&](size_t i) { return rgbOf(shaded.cameraBlend[i]); }); }},
      {"light_blend",
       [&] { return developEach(sight, 3, [&](size_t i) { return rgbOf(shaded.lightBlend[i]); }); }},
      {"stretch", [&] {
         return developEach(sight, 1, [&](size_t i) {
           const size_t surfel = sight.surfels[i];
           return std::array{
               stretchOf(deformed.u[surfel].raw().cast<double>(), deformed.v[surfel].raw().cast<double>())};
         });
       }}};
  for (const std::string& aov : options.aovs) {
    progress.checkpoint();
    film.aovs[aov] = layers.at(aov)();
  }
  clock.finish("develop");
  return film;
}

} // namespace surflect
