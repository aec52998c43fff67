// Shadows that the deformed cloud casts on itself, by one ray for each query and light.
#pragma once

#include "render/scene/scene.h"
#include "srf/weights/query.h"
#include "srf/weights/reflectance_field.h"
#include "surfel/occluders.h"

#include <optional>
#include <span>
#include <vector>

namespace surflect::surfels {

// True if frames use shadow states (srf/weights/shadow_state.h), and so need shadow rays: under kriging, by
// the given choice or else the model's. False if the model stores no shadow states.
bool castsShadows(const weights::ReflectanceField& field, const weights::ShadeOptions& options,
                  std::optional<bool> choice = {});

class CastShadows {
public:
  // Warps the occluders, which are surfels of the cloud. Throws Cancelled.
  CastShadows(const Occluders& occluders, const SurfelCloud& cloud, const scene::Scene& scene,
              const Progress& progress = {});

  // Fills batch.reached for queries at these surfels of a deformed cloud: terminatorFade, times the part of
  // the light that occluders leave.
  // Environments have no entries.
  void fill(const DeformedCloud& deformed, std::span<const uint32_t> surfels,
            weights::QueryBatch& batch) const;

private:
  struct Light {
    bool isDistant;
    Vec3<double> place; // position, or unit direction towards a distant light
  };
  std::vector<Light> lights_;
  double clearance_;
  SplatCaster<ObjectSpace> caster_;
};

} // namespace surflect::surfels
