#include "render/surfels/frame.h"

#include "render/surfels/query_kernel.h"
#include "surfel/base/processor_time.h"
#include "warp/deform.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <functional>

namespace surflect::surfels {

namespace {

class StageClock {
public:
  explicit StageClock(FrameStats& stats) : stats_(stats) {}
  // Credits the time since the last call to a stage,
  void finish(const std::string& stage) { finish(stage, 1, stage); }
  // or a share of it to one and the rest to another.
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

// A light as the query kernels know it. The light has one direction at a surfel: it is no environment.
QuerySource sourceOf(const scene::ShotLight& light) {
  const auto triple = [](const auto& t) { return std::array{t.x(), t.y(), t.z()}; };
  const auto source = [](bool isDistant, const std::array<double, 3>& place, Rgb strength) {
    return QuerySource{isDistant, {place[0], place[1], place[2]}, {strength.r, strength.g, strength.b}};
  };
  if (const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light))
    return source(true, triple(directional->towards), directional->irradiance);
  const auto& point = std::get<scene::ShotPointLight>(light);
  return source(false, triple(point.position), point.intensity);
}

QuerySource sourceOf(const capture::Camera<ObjectSpace>& camera) {
  const bool isDistant = camera.lens.model == capture::Lens::Model::orthographic;
  return sourceOf(
      isDistant ? scene::ShotLight(scene::ShotDirectionalLight{capture::Viewpoint(camera).towards({}), {}})
                : scene::ShotLight(scene::ShotPointLight{camera.center(), {}}));
}

// The three floats of each value, one value after another.
template <class Value> float* floatsOf(std::vector<Value>& values) {
  static_assert(sizeof(Value) == 3 * sizeof(float));
  return reinterpret_cast<float*>(values.data());
}
template <class Value> const float* floatsOf(const std::vector<Value>& values) {
  static_assert(sizeof(Value) == 3 * sizeof(float));
  return reinterpret_cast<const float*>(values.data());
}

ulr::LightExtrapolation uncoveredOf(const scene::ShotLight& light) {
  if (const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light))
    return directional->extrapolation;
  return std::get<scene::ShotPointLight>(light).extrapolation;
}

// Multiplies the irradiance of light l of the batch by its gradient's gain at each surfel, which the kernels
// leave out.
void shineUnevenly(const scene::ShotLight& light, size_t l, const DeformedCloud& deformed,
                   shading::QueryBatch& batch) {
  const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light);
  if (!directional || directional->irradianceGradient.isZero(0)) return;
  for (size_t query = 0; query < batch.size(); ++query) {
    const Vec3<double> place = deformed.p[batch.surfels[query]].raw().cast<double>();
    Rgb& irradiance = batch.irradiance[query * batch.lights + l];
    irradiance = static_cast<float>(capture::gainAt(directional->irradianceGradient, place)) * irradiance;
  }
}

shading::QueryEnvironment queryOf(const scene::ShotEnvironment& light) {
  const scene::PreparedEnvironment& environment = *light.environment;
  return {environment.lights, light.strength, environment.extrapolation,
          environment.table ? &*environment.table : nullptr};
}

// An AOV that is blended like colour.
struct BlendedAov {
  int channels;
  bool isConfident; // whether weights are multiplied by the surfels' confidence
  std::function<void(size_t i, float* to)> valuesOf; // writes the values of coverage.visible[i]
};

// Blends AOVs at once, with one confidence for all of them: empty, or per entry of coverage.visible.
void developAovs(const std::map<std::string_view, BlendedAov>& aovs, const std::vector<std::string>& names,
                 const splat::SplatRaster& coverage, std::span<const float> confidence, FrameLayers& film) {
  std::vector<image::Image*> pictures;
  size_t channels = 0;
  for (const std::string& name : names) {
    pictures.push_back(&film.aovs[name]);
    pictures.back()->channels = aovs.at(name).channels;
    channels += static_cast<size_t>(aovs.at(name).channels);
  }
  std::vector<float> values(coverage.visible.size() * channels);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, coverage.visible.size(), 1024),
                    [&](const tbb::blocked_range<size_t>& range) {
                      size_t channel = 0;
                      for (const std::string& name : names) {
                        const BlendedAov& aov = aovs.at(name);
                        for (size_t i = range.begin(); i < range.end(); ++i)
                          aov.valuesOf(i, &values[i * channels + channel]);
                        channel += static_cast<size_t>(aov.channels);
                      }
                    });
  splat::blendInto(pictures, coverage, values, confidence);
}

} // namespace

double stretchOf(const Vec3<double>& u, const Vec3<double>& v) {
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double mean = (uu + vv) / 2, spread = std::hypot((uu - vv) / 2, uv);
  const double smaller = u.cross(v).squaredNorm() / (mean + spread); // product over the larger root
  return std::sqrt((mean + spread) / smaller);
}

splat::SplatRaster look(const capture::Camera<ObjectSpace>& camera, const SurfelCloud& rest,
                        const DeformedCloud& deformed, const splat::SplatOptions& options,
                        const Progress& progress) {
  return splat::rasterize(camera, splat::splatsOf(rest, deformed), options, progress);
}

LookUp<double> lookUpAt(const SurfelCloud& rest, const DeformedCloud& deformed, size_t surfel) {
  const auto frame =
      polarFrame<double>(deformed.u[surfel].raw().cast<double>(), deformed.v[surfel].raw().cast<double>());
  assert(frame && deformed.handedness[surfel] != Handedness::dead);
  return {rotationOf<double>(rest.r0[surfel]), *frame, static_cast<double>(deformed.handedness[surfel])};
}

namespace {

// queriesAt, in the memory of a batch that is no longer needed.
void writeQueries(const SurfelCloud& rest, const DeformedCloud& deformed, std::span<const uint32_t> surfels,
                  const capture::Camera<ObjectSpace>& camera, std::span<const scene::ShotLight> lights,
                  const Progress& progress, shading::QueryBatch& batch) {
  batch.environments.clear();
  batch.extrapolation.clear();
  std::vector<QuerySource> sources{sourceOf(camera)}; // then lights with one direction at a surfel
  std::vector<const scene::ShotEnvironment*> environments;
  for (const scene::ShotLight& light : lights) {
    if (const auto* environment = std::get_if<scene::ShotEnvironment>(&light)) {
      environments.push_back(environment);
      batch.environments.push_back(queryOf(*environment));
    } else {
      sources.push_back(sourceOf(light));
      batch.extrapolation.push_back(uncoveredOf(light));
    }
  }
  batch.lights = sources.size() - 1;
  batch.surfels.assign(surfels.begin(), surfels.end());
  batch.towardsView.resize(surfels.size());
  batch.towardsLight.resize(surfels.size() * batch.lights);
  batch.irradiance.resize(surfels.size() * batch.lights);
  batch.acquisitionFromEnvironment.resize(surfels.size() * environments.size());
  if (surfels.empty()) return;
  sources[0].towards = floatsOf(batch.towardsView);
  sources[0].stride = 3;
  for (size_t l = 0; l < batch.lights; ++l) {
    sources[l + 1].towards = floatsOf(batch.towardsLight) + 3 * l;
    sources[l + 1].irradiance = floatsOf(batch.irradiance) + 3 * l;
    sources[l + 1].stride = 3 * batch.lights;
  }
  const auto turnEnvironments = [&](size_t query) {
    const Rotation<AcquisitionSpace, ObjectSpace> acquisitionFromObject(
        lookUpAt(rest, deformed, surfels[query]).matrix());
    for (size_t e = 0; e < environments.size(); ++e)
      batch.acquisitionFromEnvironment[query * environments.size() + e] =
          (acquisitionFromObject * environments[e]->objectFromEnvironment).cast<float>();
  };
  const QueryJob job{floatsOf(rest.r0),
                     floatsOf(deformed.p),
                     floatsOf(deformed.u),
                     floatsOf(deformed.v),
                     reinterpret_cast<const int8_t*>(deformed.handedness.data()),
                     batch.surfels.data(),
                     sources.data(),
                     sources.size()};
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, surfels.size(), 1024), [&](const tbb::blocked_range<size_t>& range) {
        progress.checkpoint();
        fillQueries(job, range.begin(), range.end());
        for (size_t query = range.begin(); !environments.empty() && query < range.end(); ++query)
          turnEnvironments(query);
      });
  size_t l = 0;
  for (const scene::ShotLight& light : lights)
    if (!std::holds_alternative<scene::ShotEnvironment>(light)) shineUnevenly(light, l++, deformed, batch);
}

} // namespace

shading::QueryBatch queriesAt(const SurfelCloud& rest, const DeformedCloud& deformed,
                              std::span<const uint32_t> surfels, const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights, const Progress& progress) {
  shading::QueryBatch batch;
  writeQueries(rest, deformed, surfels, camera, lights, progress, batch);
  return batch;
}

namespace {

image::Image develop(const splat::SplatRaster& coverage, const shading::Shaded& shaded, image::Image memory) {
  const std::span values(floatsOf(shaded.radiance), 3 * shaded.radiance.size());
  return splat::blendWithAlpha(coverage, values, 3, shaded.confidence, std::move(memory));
}

// Writes the AOVs that are asked for; erases others, which are memory of a film before.
void writeAovs(const std::vector<std::string>& asked, const splat::SplatRaster& coverage,
               const DeformedCloud& deformed, const shading::Shaded& shaded, const Progress& progress,
               FrameLayers& film) {
  const auto blendOf = [](const std::vector<Rgb>& blends) {
    return [&blends](size_t i, float* to) { to[0] = blends[i].r, to[1] = blends[i].g, to[2] = blends[i].b; };
  };
  const auto normal = [&](size_t i, float* to) {
    const size_t surfel = coverage.visible[i];
    const auto tangents =
        polarFrame<double>(deformed.u[surfel].raw().cast<double>(), deformed.v[surfel].raw().cast<double>());
    assert(tangents); // of surfels that are not dead
    const Vec3<double> outward = static_cast<double>(deformed.handedness[surfel]) * tangents->n;
    for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(outward[k]);
  };
  const auto stretch = [&](size_t i, float* to) {
    const size_t surfel = coverage.visible[i];
    *to = static_cast<float>(
        stretchOf(deformed.u[surfel].raw().cast<double>(), deformed.v[surfel].raw().cast<double>()));
  };
  const std::map<std::string_view, BlendedAov> blended{
      {"normal", {3, false, normal}},
      {"stretch", {1, false, stretch}},
      {"camera_blend", {3, true, blendOf(shaded.cameraBlend)}},
      {"light_blend", {3, true, blendOf(shaded.lightBlend)}}};
  std::erase_if(film.aovs, [&](const auto& aov) { return std::ranges::count(asked, aov.first) == 0; });
  for (const bool isConfident : {false, true}) {
    progress.checkpoint();
    std::vector<std::string> names;
    for (const std::string& name : asked)
      if (const auto aov = blended.find(name); aov != blended.end() && aov->second.isConfident == isConfident)
        names.push_back(name);
    if (!names.empty())
      developAovs(blended, names, coverage,
                  isConfident ? std::span(shaded.confidence) : std::span<const float>(), film);
  }
  if (std::ranges::count(asked, "depth") > 0)
    film.aovs["depth"] = splat::depthImage(coverage, std::move(film.aovs["depth"]));
}

} // namespace

image::Image developRadiance(const splat::SplatRaster& coverage, const shading::Shaded& shaded) {
  return develop(coverage, shaded, {});
}

FrameLayers renderFrame(const shading::ReflectanceField& field, const FrameScene& scene,
                        const FrameOptions& options, FrameWorkspace& workspace, const Progress& progress) {
  auto& [cache, deformed, coverage, memory, stats] = workspace;
  stats = {};
  StageClock clock(stats);
  deformed = warp::deform(field.cloud, scene.warp, progress, std::move(deformed));
  clock.finish("warp");
  coverage = splat::rasterize(scene.camera, splat::splatsOf(field.cloud, deformed), options.splats, progress,
                              std::move(coverage));
  stats.splats = coverage.counts;
  stats.visible = coverage.visible.size();
  clock.finish("splat");
  shading::ShadeOptions shading = options.shade;
  shading.showsBlends = std::ranges::any_of(
      options.aovs, [](const std::string& aov) { return aov == "camera_blend" || aov == "light_blend"; });
  const shading::FillBatch fill = [&](size_t begin, size_t end, shading::QueryBatch& batch) {
    const std::span surfels = std::span<const uint32_t>(coverage.visible).subspan(begin, end - begin);
    writeQueries(field.cloud, deformed, surfels, scene.camera, scene.lights, progress, batch);
    clock.finish("queries");
  };
  const shading::Shaded shaded =
      shading::shade(field, coverage.visible.size(), fill, shading, cache, stats.shading, progress,
                     [&](double planning) { clock.finish("ulr", planning, "look-up"); });
  stats.unseen = shaded.unseen;
  FrameLayers film = std::move(memory);
  film.color = develop(coverage, shaded, std::move(film.color));
  clock.finish("develop");
  writeAovs(options.aovs, coverage, deformed, shaded, progress, film);
  if (!options.aovs.empty()) clock.finish("aov");
  return film;
}

} // namespace surflect::surfels
