#include "render/surfels/cast_shadows.h"

#include "srf/weights/fades.h"
#include "warp/deform.h"

#include <tbb/blocked_range.h>
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
  if (std::exchange(isForgotten_, false) || poses_.size() != surfels) {
    lights_.clear(); // memory of states is used again
    poses_.resize(surfels);
  }
  std::vector<std::vector<float>> before = std::exchange(states_, {});
  std::vector<size_t> isNew;
  for (size_t l = 0; l < lights.size(); ++l) {
    const auto known = static_cast<size_t>(std::ranges::find(lights_, lights[l]) - lights_.begin());
    // A light that is named twice takes the states only once.
    if (known < lights_.size() && before[known].size() == surfels)
      states_.push_back(std::exchange(before[known], {}));
    else
      states_.emplace_back(), isNew.push_back(l);
  }
  lights_.assign(lights.begin(), lights.end());
  for (const size_t l : isNew) {
    const auto free = std::ranges::find_if(before, [](const auto& states) { return !states.empty(); });
    if (free != before.end()) states_[l] = std::exchange(*free, {});
    states_[l].resize(surfels);
    tbb::parallel_for(tbb::blocked_range<size_t>(0, surfels), [&](const tbb::blocked_range<size_t>& range) {
      std::fill(states_[l].begin() + static_cast<std::ptrdiff_t>(range.begin()),
                states_[l].begin() + static_cast<std::ptrdiff_t>(range.end()), kUnknown);
    });
  }
}

void KeptShadows::pose(uint32_t surfel, const DeformedCloud& deformed, uint32_t drawn) {
  const Pose now{deformed.p[drawn], deformed.u[drawn], deformed.v[drawn], deformed.handedness[drawn]};
  Pose& pose = poses_[surfel];
  if (pose.handedness != now.handedness || pose.p != now.p || pose.u != now.u || pose.v != now.v) {
    pose = now;
    for (std::vector<float>& states : states_) states[surfel] = kUnknown;
  }
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
    const uint32_t number = numbers_.empty() ? surfel : numbers_[surfel]; // in the field
    if (kept_) kept_->pose(number, deformed, surfel);
    for (size_t l = 0; l < lights; ++l) {
      float& state = batch.reached[query * lights + l];
      state = kept_ ? kept_->stateAt(number, l) : kUnknown;
      if (std::isnan(state)) state = stateOf(*caster_, clearance_, deformed, surfel, lights_[l]);
      if (kept_) kept_->stateAt(number, l) = state;
    }
  });
}

} // namespace surflect::surfels
