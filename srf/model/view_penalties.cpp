#include "srf/model/view_penalties.h"

namespace surflect {

namespace {
constexpr float kInfinity = std::numeric_limits<float>::infinity();
}

ViewPenalties::ViewPenalties(const Model& model, bool nearest)
    : model_(model), nearest_(nearest), penalty_(model.rig.views.size()), anglePenalty_(penalty_),
      standInScale_(penalty_) {
  for (const View& view : model.rig.views) viewpoints_.emplace_back(view.camera);
}

bool ViewPenalties::rate(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView) {
  const auto p0 = model_.cloud.p0[surfel].cast<double>();
  const auto fades = model_.fades.of(surfel);
  float best = kInfinity;
  for (size_t view = 0; view < penalty_.size(); ++view) {
    penalty_[view] = standInScale_[view] = kInfinity;
    if (fades[view] == 0) continue;
    const float penalty = anglePenalty(viewpoints_[view].towards(p0).cast<float>(), towardsView);
    penalty_[view] = nearest_ ? penalty : penalty / ViewFades::decode(fades[view]);
    best = std::min(best, penalty_[view]);
  }
  if (best == kInfinity || (best > kStandInFrom && !nearest_)) rateStandIns(surfel, towardsView);
  return best < kInfinity;
}

void ViewPenalties::rateStandIns(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView) {
  const auto p0 = model_.cloud.p0[surfel].cast<double>();
  const auto fades = model_.fades.of(surfel);
  const Vec3<double> normal = rotationOf<double>(model_.cloud.r0[surfel]).col(2);
  for (size_t view = 0; view < penalty_.size(); ++view) {
    const auto& camera = model_.rig.views[view].camera;
    const auto pixel = camera.project(p0);
    if (!pixel || !contains(camera.lens, *pixel)) continue;
    const auto towardsCamera = viewpoints_[view].towards(p0);
    anglePenalty_[view] = anglePenalty(towardsCamera.cast<float>(), towardsView);
    standInScale_[view] = standInScale(normal.dot(towardsCamera.raw()), borderFade(camera.lens, *pixel),
                                       ViewFades::decode(fades[view]));
  }
}

BlendSet ViewPenalties::blend(size_t count) const {
  NearestCandidates nearest(count);
  for (uint32_t view = 0; view < penalty_.size(); ++view) nearest.offer({view, with(view, 0)});
  return ulrWeights(nearest);
}

} // namespace surflect
