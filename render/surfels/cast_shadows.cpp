#include "render/surfels/cast_shadows.h"

#include "srf/weights/fades.h"
#include "warp/deform.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

namespace surflect::surfels {

bool castsShadows(const weights::ReflectanceField& field, const weights::ShadeOptions& options,
                  std::optional<bool> choice) {
  return choice.value_or(usesShadowStates(field, options)) && field.lightVisibility && field.levels &&
         usesKriging(field, options);
}

CastShadows::CastShadows(const Occluders& occluders, const SurfelCloud& cloud, const scene::Scene& scene,
                         const Progress& progress)
    : clearance_(occluders.clearance),
      caster_(casterOf(occluders, warp::deform(subsetOf(cloud, occluders.surfels), scene.warp, progress),
                       progress)) {
  for (const scene::ShotLight& light : scene.lights) {
    if (const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light))
      lights_.push_back({true, directional->towards.raw()});
    else if (const auto* point = std::get_if<scene::ShotPointLight>(&light))
      lights_.push_back({false, point->position.raw()});
  }
}

void CastShadows::fill(const DeformedCloud& deformed, std::span<const uint32_t> surfels,
                       weights::QueryBatch& batch) const {
  batch.reached.resize(surfels.size() * lights_.size());
  tbb::parallel_for(size_t{0}, surfels.size(), [&](size_t query) {
    const uint32_t i = surfels[query];
    const Vec3<double> u = deformed.u[i].raw().cast<double>(), v = deformed.v[i].raw().cast<double>();
    // A mirrored surfel has its front where v x u points.
    const double side = deformed.handedness[i] == Handedness::mirrored ? -1 : 1;
    const auto normal = assume<Normal3<ObjectSpace, double>>(side * u.cross(v).normalized());
    const auto p = deformed.p[i].cast<double>();
    const double clearance = clearance_ * longerAxis(u, v);
    for (size_t l = 0; l < lights_.size(); ++l) {
      const auto& [isDistant, place] = lights_[l];
      const Vec3<double> way = isDistant ? place : Vec3<double>(place - p.raw());
      const double distance = isDistant ? std::numeric_limits<double>::infinity() : way.norm();
      const auto towards =
          assume<Direction3<ObjectSpace, double>>(isDistant ? way : Vec3<double>(way / distance));
      const auto lit = static_cast<float>(weights::terminatorFade(dot(normal, towards)));
      batch.reached[query * lights_.size() + l] =
          lit > 0 ? lit * reaching(caster_, p, normal, towards, distance, clearance) : 0;
    }
  });
}

} // namespace surflect::surfels
