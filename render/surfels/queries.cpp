#include "render/surfels/queries.h"

#include "render/surfels/query_kernel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>
#include <cassert>
#include <cmath>

namespace surflect::surfels {

namespace {

// Converts a light for the query kernels. Environments are not allowed: a light must have one direction at a
// surfel.
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

weights::LightExtrapolation extrapolationOf(const scene::ShotLight& light) {
  if (const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light))
    return directional->extrapolation;
  return std::get<scene::ShotPointLight>(light).extrapolation;
}

// Multiplies the irradiance of light l of the batch by its gradient's gain at each surfel, which the kernels
// leave out.
void shineUnevenly(const scene::ShotLight& light, size_t l, const DeformedCloud& deformed,
                   weights::QueryBatch& batch) {
  const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light);
  if (!directional || directional->irradianceGradient.isZero(0)) return;
  for (size_t query = 0; query < batch.size(); ++query) {
    const Vec3<double> place = deformed.p[batch.surfels[query]].raw().cast<double>();
    Rgb& irradiance = batch.irradiance[query * batch.lights + l];
    irradiance = static_cast<float>(capture::gainAt(directional->irradianceGradient, place)) * irradiance;
  }
}

weights::QueryEnvironment queryOf(const scene::ShotEnvironment& light,
                                  const PreparedEnvironment& environment) {
  return {environment.lights, light.strength, environment.extrapolation,
          environment.table ? &*environment.table : nullptr};
}

} // namespace

LookUp<double> lookUpAt(const SurfelCloud& rest, const DeformedCloud& deformed, size_t surfel) {
  const auto frame =
      polarFrame<double>(deformed.u[surfel].raw().cast<double>(), deformed.v[surfel].raw().cast<double>());
  assert(frame && deformed.handedness[surfel] != Handedness::dead);
  return {rotationOf<double>(rest.r0[surfel]), *frame, static_cast<double>(deformed.handedness[surfel])};
}

DeformedCloud withBisectorFrames(DeformedCloud deformed, const Progress& progress) {
  tbb::parallel_for(size_t{0}, deformed.size(), [&](size_t surfel) {
    progress.checkNowAndThen(surfel);
    Direction3<ObjectSpace>&u = deformed.u[surfel], &v = deformed.v[surfel];
    const auto frame = bisectorFrame<double>(u.raw().cast<double>(), v.raw().cast<double>());
    if (!frame) return; // a dead surfel
    u = assume<Direction3<ObjectSpace>>(Vec3<float>(frame->u.cast<float>()));
    v = assume<Direction3<ObjectSpace>>(Vec3<float>(frame->v.cast<float>()));
  });
  return deformed;
}

DeformedCloud withCarriedLines(DeformedCloud deformed, std::span<const Angle> lines,
                               const Progress& progress) {
  assert(lines.size() == deformed.size());
  tbb::parallel_for(size_t{0}, deformed.size(), [&](size_t surfel) {
    progress.checkNowAndThen(surfel);
    Direction3<ObjectSpace>&u = deformed.u[surfel], &v = deformed.v[surfel];
    const Vec3<double> ju = u.raw().cast<double>(), jv = v.raw().cast<double>();
    const auto frame = polarFrame<double>(ju, jv);
    if (!frame) return; // a dead surfel
    const double angle = lines[surfel].radians();
    const Vec3<double> line = std::cos(angle) * ju + std::sin(angle) * jv;
    const double turn = std::atan2(line.dot(frame->v), line.dot(frame->u)) - angle;
    const Vec3<double> turnedU = std::cos(turn) * frame->u + std::sin(turn) * frame->v;
    const Vec3<double> turnedV = std::cos(turn) * frame->v - std::sin(turn) * frame->u;
    u = assume<Direction3<ObjectSpace>>(Vec3<float>(turnedU.cast<float>()));
    v = assume<Direction3<ObjectSpace>>(Vec3<float>(turnedV.cast<float>()));
  });
  return deformed;
}

void writeQueries(const SurfelCloud& rest, const DeformedCloud& deformed, std::span<const uint32_t> surfels,
                  const capture::Camera<ObjectSpace>& camera, std::span<const scene::ShotLight> lights,
                  std::span<const PreparedEnvironment* const> prepared, const Progress& progress,
                  weights::QueryBatch& batch) {
  batch.environments.clear();
  batch.extrapolation.clear();
  std::vector<QuerySource> sources{sourceOf(camera)}; // then lights with one direction at a surfel
  std::vector<const scene::ShotEnvironment*> environments;
  for (const scene::ShotLight& light : lights) {
    if (const auto* environment = std::get_if<scene::ShotEnvironment>(&light)) {
      assert(environments.size() < prepared.size());
      batch.environments.push_back(queryOf(*environment, *prepared[environments.size()]));
      environments.push_back(environment);
    } else {
      sources.push_back(sourceOf(light));
      batch.extrapolation.push_back(extrapolationOf(light));
    }
  }
  batch.lights = sources.size() - 1;
  batch.surfels.assign(surfels.begin(), surfels.end());
  batch.places.clear();
  batch.firstPlace.clear();
  batch.cornerWeights.clear();
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
      tbb::blocked_range<size_t>(0, surfels.size(), 128), [&](const tbb::blocked_range<size_t>& range) {
        progress.checkpoint();
        fillQueries(job, range.begin(), range.end());
        for (size_t query = range.begin(); !environments.empty() && query < range.end(); ++query)
          turnEnvironments(query);
      });
  size_t l = 0;
  for (const scene::ShotLight& light : lights)
    if (!std::holds_alternative<scene::ShotEnvironment>(light)) shineUnevenly(light, l++, deformed, batch);
}

weights::QueryBatch queriesAt(const SurfelCloud& rest, const DeformedCloud& deformed,
                              std::span<const uint32_t> surfels, const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights,
                              std::span<const PreparedEnvironment* const> environments,
                              const Progress& progress) {
  weights::QueryBatch batch;
  writeQueries(rest, deformed, surfels, camera, lights, environments, progress, batch);
  return batch;
}

} // namespace surflect::surfels
