#include "render/surfels/cast_shadows.h"

#include "srf/weights/fades.h"
#include "warp/deform.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace surflect::surfels {

namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

} // namespace

bool castsShadows(const weights::ReflectanceField& field, const weights::ShadeOptions& options,
                  std::optional<bool> choice) {
  return choice.value_or(usesShadowStates(field, options)) && field.lightVisibility && field.levels &&
         usesKriging(field, options);
}

bool WarpedOccluders::follow(const warp::Warp& warp, const Progress& progress) {
  const std::shared_ptr<const SplatCaster<ObjectSpace>> before = std::exchange(caster_, nullptr);
  const bool hasChanged = warp::deformInto(rest_, warp, progress, deformed_) || !before;
  caster_ = hasChanged
                ? std::make_shared<const SplatCaster<ObjectSpace>>(casterOf(*occluders_, deformed_, progress))
                : before;
  return hasChanged;
}

void KeptShadows::arrange(std::span<const ShadowLight> lights, size_t surfels) {
  constexpr size_t kMostBytes = size_t{256} << 20;
  if (surfels * (sizeof(Pose) + sizeof(float) * lights.size()) > kMostBytes) return clear();
  if (std::ranges::equal(lights, lights_) && poses_.size() == surfels) return;
  poses_.resize(surfels);
  const std::vector<float> before = std::exchange(states_, std::vector(surfels * lights.size(), kUnknown));
  const std::vector<ShadowLight> lightsBefore =
      std::exchange(lights_, std::vector(lights.begin(), lights.end()));
  if (before.size() != surfels * lightsBefore.size()) return;
  for (size_t l = 0; l < lights.size(); ++l) {
    const auto known = static_cast<size_t>(std::ranges::find(lightsBefore, lights[l]) - lightsBefore.begin());
    if (known == lightsBefore.size()) continue;
    for (size_t i = 0; i < surfels; ++i)
      states_[i * lights.size() + l] = before[i * lightsBefore.size() + known];
  }
}

float* KeptShadows::at(uint32_t surfel, const DeformedCloud& deformed, uint32_t drawn) {
  const Pose now{deformed.p[drawn], deformed.u[drawn], deformed.v[drawn], deformed.handedness[drawn]};
  Pose& pose = poses_[surfel];
  float* states = states_.data() + surfel * lights_.size();
  if (pose.handedness != now.handedness || pose.p != now.p || pose.u != now.u || pose.v != now.v) {
    pose = now;
    std::fill_n(states, lights_.size(), kUnknown);
  }
  return states;
}

CastShadows::CastShadows(const WarpedOccluders& occluders, const scene::Scene& scene)
    : clearance_(occluders.clearance()), caster_(occluders.caster()) {
  assert(caster_);
  for (const scene::ShotLight& light : scene.lights) {
    if (const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light))
      lights_.push_back({true, directional->towards.raw()});
    else if (const auto* point = std::get_if<scene::ShotPointLight>(&light))
      lights_.push_back({false, point->position.raw()});
  }
}

void CastShadows::keepIn(KeptShadows& kept, size_t surfels, std::span<const uint32_t> numbers) {
  kept.arrange(lights_, surfels);
  if (kept.isEmpty()) return;
  kept_ = &kept;
  numbers_ = numbers;
}

CastShadows::CastShadows(const Occluders& occluders, const SurfelCloud& cloud, const scene::Scene& scene,
                         const Progress& progress)
    : CastShadows(
          [&] {
            WarpedOccluders warped(occluders, cloud);
            warped.follow(scene.warp, progress);
            return warped;
          }(),
          scene) {}

namespace {

// State of a surfel under a light.
float stateOf(const SplatCaster<ObjectSpace>& caster, double clearance, const DeformedCloud& deformed,
              uint32_t i, const ShadowLight& light) {
  const Vec3<double> u = deformed.u[i].raw().cast<double>(), v = deformed.v[i].raw().cast<double>();
  // A mirrored surfel has its front where v x u points.
  const double side = deformed.handedness[i] == Handedness::mirrored ? -1 : 1;
  const auto normal = assume<Normal3<ObjectSpace, double>>(side * u.cross(v).normalized());
  const auto p = deformed.p[i].cast<double>();
  const Vec3<double> way = light.isDistant ? light.place : Vec3<double>(light.place - p.raw());
  const double distance = light.isDistant ? std::numeric_limits<double>::infinity() : way.norm();
  const auto towards =
      assume<Direction3<ObjectSpace, double>>(light.isDistant ? way : Vec3<double>(way / distance));
  const auto lit = static_cast<float>(weights::terminatorFade(dot(normal, towards)));
  return lit > 0 ? lit * reaching(caster, p, normal, towards, distance, clearance * longerAxis(u, v)) : 0;
}

} // namespace

void CastShadows::fill(const DeformedCloud& deformed, std::span<const uint32_t> surfels,
                       weights::QueryBatch& batch) const {
  const size_t lights = lights_.size();
  batch.reached.resize(surfels.size() * lights);
  tbb::parallel_for(size_t{0}, surfels.size(), [&](size_t query) {
    const uint32_t surfel = surfels[query];
    float* known =
        kept_ ? kept_->at(numbers_.empty() ? surfel : numbers_[surfel], deformed, surfel) : nullptr;
    for (size_t l = 0; l < lights; ++l) {
      float& state = batch.reached[query * lights + l];
      state = known ? known[l] : kUnknown;
      if (std::isnan(state)) state = stateOf(*caster_, clearance_, deformed, surfel, lights_[l]);
      if (known) known[l] = state;
    }
  });
}

} // namespace surflect::surfels
