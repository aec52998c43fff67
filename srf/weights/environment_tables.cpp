#include "srf/weights/environment_tables.h"

namespace surflect::weights {

void EnvironmentTables::moveTo(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView) {
  surfel_ = surfel;
  own_ = surfelOfTables(field_, surfel);
  share_ = own_.shareOf(towardsView);
  views_.clear();
  lights_.clear();
  weights_.clear();
  if (!answer()) return;
  rig_.moveTo(surfel);
  towardsView_ = own_.surfelFromAcquisition(towardsView);
}

// Nothing is reflected of a light behind the surface.
void EnvironmentTables::add(const SurfelDirection& view, const SurfelDirection& light, const Rgb& weight) {
  if (!(light.z() > 0) || weight == Rgb{}) return;
  views_.push_back(view);
  lights_.push_back(light);
  weights_.push_back(weight);
}

void EnvironmentTables::add(const Direction3<AcquisitionSpace>& towardsLight, const Rgb& reaching) {
  add(towardsView_, own_.surfelFromAcquisition(towardsLight), reaching);
}

void EnvironmentTables::takeAway(uint32_t view, uint32_t light, const Rgb& irradiance) {
  const float state = field_.lightVisibility ? rig_.reachedBy(light) : 1;
  add(own_.surfelFromAcquisition(rig_.towardsView(view)),
      own_.surfelFromAcquisition(rig_.lights().towards(light)), -state * irradiance);
}

Rgb EnvironmentTables::correction() {
  if (!answer()) return {};
  reflectance_.resize(weights_.size());
  predictReflectance(field_.shared->tables, field_.shared->mixtures[surfel_], views_, lights_, reflectance_);
  Rgb sum;
  for (size_t i = 0; i < weights_.size(); ++i) sum = sum + weights_[i] * reflectance_[i];
  return share_ * sum;
}

} // namespace surflect::weights
