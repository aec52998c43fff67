// Shadows that the deformed cloud casts on itself, by one ray for each query and light.
#pragma once

#include "render/scene/scene.h"
#include "srf/shading/query.h"
#include "srf/shading/reflectance_field.h"
#include "surfel/occluders.h"

#include <optional>
#include <span>
#include <vector>

namespace surflect::surfels {

// True if photographs are told from one another by whether they show a surfel lit: the given choice, or the
// model's for kriging. By default always for pairs, which else blend photographs with the requested half
// vector that show the surfel turned away from the light.
bool castsShadows(const shading::ReflectanceField& field, const shading::ShadeOptions& options,
                  std::optional<bool> choice = {});

class CastShadows {
public:
  // Warps the occluders, which are surfels of the cloud. Throws Cancelled.
  CastShadows(const Occluders& occluders, const SurfelCloud& cloud, const scene::Scene& scene,
              const Progress& progress = {});

  // Fills batch.reached, with 0 or terminatorFade, for queries at these surfels of a deformed cloud.
  // Environments have no entries.
  void fill(const DeformedCloud& deformed, std::span<const uint32_t> surfels,
            shading::QueryBatch& batch) const;

private:
  struct Light {
    bool isDistant;
    Vec3<double> place; // position, or unit direction towards a distant light
  };
  std::vector<Light> lights_;
  double clearance_;
  DiscCaster<ObjectSpace> caster_;
};

} // namespace surflect::surfels
