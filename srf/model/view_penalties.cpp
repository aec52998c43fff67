#include "srf/model/view_penalties.h"

namespace surflect {

namespace {
constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::vector<Source> sourcesOf(const Model& model) {
  std::vector<Source> sources;
  for (const auto& [identity, camera] : model.rig.views) {
    const bool isDistant = camera.lens.model == Lens::Model::orthographic;
    const Vec3<double> backwards = Viewpoint(camera).towards(camera.center()).raw();
    sources.push_back({isDistant ? backwards : camera.center().raw(), isDistant});
  }
  return sources;
}

} // namespace

ViewPenalties::ViewPenalties(const Model& model, const Point3<AcquisitionSpace, double>& middle, bool nearest,
                             Simd simd)
    : model_(model), nearest_(nearest), sieve_(sourcesOf(model), middle.raw(), simd),
      penalty_(model.rig.views.size()), anglePenalty_(penalty_), standInScale_(penalty_) {
  for (const View& view : model.rig.views) viewpoints_.emplace_back(view.camera);
}

float ViewPenalties::penaltyOf(size_t view, const Point3<AcquisitionSpace, double>& p0, uint8_t fade,
                               const Direction3<AcquisitionSpace>& towardsView) const {
  const float penalty = anglePenalty(viewpoints_[view].towards(p0).cast<float>(), towardsView);
  return nearest_ ? penalty : penalty / ViewFades::decode(fade);
}

bool ViewPenalties::rate(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView) {
  const auto p0 = model_.cloud.p0[surfel].cast<double>();
  const auto fades = model_.fades.of(surfel);
  float best = kInfinity;
  for (size_t view = 0; view < penalty_.size(); ++view) {
    penalty_[view] = standInScale_[view] = kInfinity;
    if (fades[view] == 0) continue;
    penalty_[view] = penaltyOf(view, p0, fades[view], towardsView);
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

ViewPenalties::Rated ViewPenalties::blend(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView,
                                          size_t count) {
  const auto p0 = model_.cloud.p0[surfel].cast<double>();
  const auto fades = model_.fades.of(surfel);
  NearestCandidates nearest(count);
  sieve_.lookFrom(p0.raw());
  for (const uint32_t view : sieve_.nearest(towardsView, count + 1, fades, !nearest_))
    nearest.offer({view, penaltyOf(view, p0, fades[view], towardsView)});
  const auto best = nearest.sorted();
  if (!best.empty() && (best[0].penalty <= kStandInFrom || nearest_)) return {ulrWeights(nearest), true};

  const bool isSeen = rate(surfel, towardsView);
  NearestCandidates all(count);
  for (uint32_t view = 0; view < penalty_.size(); ++view) all.offer({view, with(view, 0)});
  return {ulrWeights(all), isSeen};
}

} // namespace surflect
