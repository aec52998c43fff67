#include "srf/model/view_penalties.h"

namespace surflect::model {

namespace {
constexpr float kInfinity = std::numeric_limits<float>::infinity();
} // namespace

std::vector<ulr::Source> sourcesOf(std::span<const capture::View> views) {
  std::vector<ulr::Source> sources;
  for (const capture::View& view : views) {
    const capture::Viewpoint viewpoint(view.camera);
    sources.push_back({viewpoint.place(), viewpoint.isDistant()});
  }
  return sources;
}

ViewPenalties::ViewPenalties(const Model& model, bool nearest, Simd simd)
    : model_(model), nearest_(nearest), look_(sourcesOf(model.rig.views), simd),
      penalty_(model.rig.views.size()), anglePenalty_(penalty_), standInScale_(penalty_) {
  for (const capture::View& view : model.rig.views) viewpoints_.emplace_back(view.camera);
}

float ViewPenalties::penaltyOf(size_t view, const Point3<AcquisitionSpace, double>& p0, uint8_t fade,
                               const Direction3<AcquisitionSpace>& towardsView) const {
  const float penalty = ulr::anglePenalty(viewpoints_[view].towards(p0).cast<float>(), towardsView);
  return nearest_ ? penalty : penalty / ulr::VisibilityWeights::decode(fade);
}

float ViewPenalties::rateSeeing(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView) {
  const auto p0 = model_.cloud.p0[surfel].cast<double>();
  const auto fades = model_.fades.of(surfel);
  float best = kInfinity;
  for (size_t view = 0; view < penalty_.size(); ++view) {
    penalty_[view] = kInfinity;
    if (fades[view] == 0) continue;
    penalty_[view] = penaltyOf(view, p0, fades[view], towardsView);
    best = std::min(best, penalty_[view]);
  }
  return best;
}

// The views as they stand in for others at a surfel.
class ViewPenalties::StandIns {
public:
  StandIns(const ViewPenalties& views, uint32_t surfel)
      : views_(views), p0_(views.model_.cloud.p0[surfel].cast<double>()),
        normal_(rotationOf<double>(views.model_.cloud.r0[surfel]).col(2)),
        fades_(views.model_.fades.of(surfel)) {}

  // Of the following.
  void look(size_t view, const Direction3<AcquisitionSpace>& towardsView) {
    view_ = view;
    const auto towards = views_.viewpoints_[view].towards(p0_);
    cosine_ = normal_.dot(towards.raw());
    angle_ = ulr::anglePenalty(towards.cast<float>(), towardsView);
  }
  Normal3<AcquisitionSpace> normal() const { return assume<Normal3<AcquisitionSpace>>(normal_); }
  float angle() const { return angle_; }
  // Infinite where the view does not have the surfel in its image.
  float scale() const {
    const auto& camera = views_.model_.rig.views[view_].camera;
    const auto pixel = camera.project(p0_);
    if (!pixel || !capture::contains(camera.lens, *pixel)) return kInfinity;
    return ulr::fallbackScale(cosine_, ulr::borderFade(camera.lens, *pixel),
                              ulr::VisibilityWeights::decode(fades_[view_]));
  }

private:
  const ViewPenalties& views_;
  Point3<AcquisitionSpace, double> p0_;
  Vec3<double> normal_;
  std::span<const uint8_t> fades_;
  size_t view_ = 0;
  double cosine_ = 0;
  float angle_ = 0;
};

Sight ViewPenalties::rate(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView) {
  const float best = rateSeeing(surfel, towardsView);
  Sight sight{best, best < kInfinity};
  std::ranges::fill(standInScale_, kInfinity);
  if (!asksStandIns(best)) return sight;
  StandIns standIns(*this, surfel);
  for (size_t view = 0; view < penalty_.size(); ++view) {
    standIns.look(view, towardsView);
    anglePenalty_[view] = standIns.angle();
    standInScale_[view] = standIns.scale();
    sight.penalty = std::min(sight.penalty, with(view, 0));
  }
  return sight;
}

ViewPenalties::Rated ViewPenalties::blend(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView,
                                          size_t count) {
  const float best = rateSeeing(surfel, towardsView);
  ulr::NearestCandidates nearest(count);
  if (!asksStandIns(best)) {
    for (uint32_t view = 0; view < penalty_.size(); ++view) nearest.offer({view, penalty_[view]});
    return {ulr::ulrWeights(nearest), {best, true}};
  }
  StandIns standIns(*this, surfel);
  look_.look(model_.cloud.p0[surfel], towardsView, standIns.normal());
  const auto angles = look_.penalties(), cosines = look_.cosines();
  const auto fades = model_.fades.of(surfel);
  for (uint32_t view = 0; view < penalty_.size(); ++view) {
    float penalty = penalty_[view];
    const float least =
        ulr::leastFallbackPenalty(angles[view], cosines[view], fades[view] > 0, ulr::SourceLook::kError);
    if (!(least >= nearest.worst())) { // else it would not be kept
      standIns.look(view, towardsView);
      penalty = std::min(penalty, ulr::fallbackPenalty(standIns.angle(), standIns.scale()));
    }
    nearest.offer({view, penalty});
  }
  const float least = nearest.sorted().empty() ? kInfinity : nearest.sorted()[0].penalty;
  return {ulr::ulrWeights(nearest), {least, best < kInfinity}};
}

} // namespace surflect::model
