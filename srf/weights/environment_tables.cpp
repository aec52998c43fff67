#include "srf/weights/environment_tables.h"

#include <cassert>
#include <utility>

namespace surflect::weights {

void EnvironmentTables::moveTo(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView) {
  surfel_ = surfel;
  own_ = surfelOfTables(field_, surfel);
  share_ = own_.shareOf(towardsView);
  views_.clear();
  viewers_.clear();
  lights_.clear();
  weights_.clear();
  litTerms_ = 0;
  all_ = 0;
  if (!answer()) return;
  rig_.moveTo(surfel);
  towardsView_ = own_.surfelFromAcquisition(towardsView);
  captured_.clear();
  for (const auto& towards : rig_.lights().towards())
    captured_.push_back(own_.surfelFromAcquisition(towards));
}

// Nothing is reflected of a light behind the surface.
void EnvironmentTables::add(const SurfelDirection& view, const SurfelDirection& light, const Rgb& weight) {
  if (!(light.z() > 0) || weight == Rgb{}) return;
  viewers_.push_back(view);
  lights_.push_back(light);
  weights_.push_back(weight);
}

void EnvironmentTables::add(const Direction3<AcquisitionSpace>& towardsLight, const Rgb& reaching) {
  assert(views_.empty());
  add(towardsView_, own_.surfelFromAcquisition(towardsLight), reaching);
  litTerms_ = weights_.size();
}

void EnvironmentTables::addView(uint32_t view, float weight) {
  const SurfelDirection towards = own_.surfelFromAcquisition(rig_.towardsView(view));
  views_.push_back({view, weight, SurfelOfTables::viewFade(towards.z()), towards, weights_.size()});
  all_ += weight;
}

void EnvironmentTables::takeAway(uint32_t light, const Rgb& irradiance) {
  View& view = views_.back();
  if (irradiance == Rgb{} || !(view.fade > 0)) return;
  const float state = field_.lightVisibility ? rig_.reachedBy(light) : 1;
  // K shows nothing in channels in which the captured light counts as dark.
  const Eigen::Array4f ratio = rig_.lights().ratio(Eigen::Array4f::Ones(), light);
  const auto shown = [&](int channel, float value) { return ratio[channel] > 0 ? value : 0; };
  add(view.towards, captured_[light],
      state * Rgb{shown(1, irradiance.r), shown(2, irradiance.g), shown(3, irradiance.b)});
  view.terms = weights_.size();
}

void EnvironmentTables::lookUp() {
  reflectance_.resize(weights_.size());
  predictReflectance(field_.shared->tables, field_.shared->mixtures[surfel_], viewers_, lights_,
                     reflectance_);
  const auto sumOf = [&](size_t begin, size_t end) {
    Rgb sum;
    for (size_t i = begin; i < end; ++i) sum = sum + weights_[i] * reflectance_[i];
    return sum;
  };
  lit_ = sumOf(0, litTerms_);
  size_t begin = litTerms_;
  for (View& view : views_) view.taken = sumOf(std::exchange(begin, view.terms), view.terms);
}

} // namespace surflect::weights
