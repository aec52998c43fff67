// The rig as a surfel sees it: directions to cameras and lights, which cameras see the surfel, and which
// lights reach it.
#pragma once

#include "srf/weights/irradiance_ratio.h"
#include "srf/weights/nearest_sources.h"
#include "srf/weights/reflectance_field.h"

#include <cstdint>
#include <vector>

namespace surflect::weights {

class RigAtSurfel {
public:
  // The field must outlive this.
  explicit RigAtSurfel(const ReflectanceField& field)
      : field_(field), viewpoints_(viewpointsOf(field.rig.views)), lights_(field.rig.lights) {}

  // Turns to another surfel; call before the methods below.
  void moveTo(uint32_t surfel) {
    surfel_ = surfel;
    lights_.moveTo(field_.cloud.p0[surfel].cast<double>());
    lights_.evaluateAll();
    normal_ = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(field_.cloud.r0[surfel]).col(2));
  }

  const CapturedLights& lights() const { return lights_; }
  Direction3<AcquisitionSpace> towardsView(size_t view) const {
    return viewpoints_[view].towards(lights_.place()).cast<float>();
  }
  // Visibility weight of a view, 0..1.
  float seenBy(size_t view) const { return VisibilityWeights::decode(field_.visibility.of(surfel_)[view]); }
  // Shadow state under a captured light, 0..1, for a field with lightVisibility.
  float reachedBy(size_t light) const {
    return VisibilityWeights::decode(field_.lightVisibility->of(surfel_)[light]);
  }
  // Foreshortened cosine of a direction.
  float cosine(const Direction3<AcquisitionSpace>& towards) const {
    return foreshortenedCosine(normal_, towards);
  }

private:
  const ReflectanceField& field_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  CapturedLights lights_;
  uint32_t surfel_ = 0;
  Normal3<AcquisitionSpace> normal_;
};

} // namespace surflect::weights
