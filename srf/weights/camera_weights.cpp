#include "srf/weights/camera_weights.h"

#include <algorithm>

namespace surflect::weights {

CameraWeights::CameraWeights(const ReflectanceField& field, const QueryBatch& batch,
                             const ShadeOptions& options)
    : field_(field), batch_(batch), count_(options.nearest ? 1 : options.cameras), nearest_(options.nearest),
      weightError_(options.weightError), viewpoints_(viewpointsOf(field.rig.views)),
      nearestViews_(sourcesOf(viewpoints_), field.visibility, options.weightError),
      penalty_(viewpoints_.size()), angle_(penalty_), fallbackScale_(penalty_) {}

void CameraWeights::prepare(size_t begin, size_t count) {
  begin_ = begin;
  if (nearest_) return;
  blends_ = &nearestViews_.blend({batch_.surfels.data() + begin, count},
                                 {batch_.placesAt(field_.cloud, begin, count).data(), count},
                                 {batch_.towardsView.data() + begin, count}, count_);
  const size_t next = begin + count, ahead = std::min(kQueryLanes, batch_.surfels.size() - next);
  nearestViews_.prefetchFades({batch_.surfels.data() + next, ahead});
}

CameraWeights::Query CameraWeights::queryAt(size_t query) const {
  const uint32_t surfel = batch_.surfels[query];
  return {field_.cloud.p0[surfel].cast<double>(), rotationOf<double>(field_.cloud.r0[surfel]).col(2),
          field_.visibility.of(surfel), batch_.towardsView[query]};
}

CameraWeights::Fallback CameraWeights::fallbackOf(size_t view, const Query& query) const {
  const auto towards = viewpoints_[view].towards(query.p0);
  const auto& camera = field_.rig.views[view].camera;
  const auto pixel = camera.project(query.p0);
  const bool isInImage = pixel && capture::contains(camera.lens, *pixel);
  return {anglePenalty(towards.cast<float>(), query.towardsView),
          isInImage ? fallbackScale(query.normal.dot(towards.raw()), borderFade(camera.lens, *pixel),
                                    VisibilityWeights::decode(query.visibility[view]))
                    : kInfinity};
}

// Computes p_i of all views that see the surfel, and infinity for the others; returns the least.
float CameraWeights::computeSeenPenalties(const Query& query) {
  float least = kInfinity;
  for (size_t view = 0; view < penalty_.size(); ++view) {
    penalty_[view] = kInfinity;
    if (query.visibility[view] == 0) continue;
    const float angle = anglePenalty(viewpoints_[view].towards(query.p0).cast<float>(), query.towardsView);
    penalty_[view] = nearest_ ? angle : angle / VisibilityWeights::decode(query.visibility[view]);
    least = std::min(least, penalty_[view]);
  }
  return least;
}

BestView CameraWeights::computePenalties(size_t number) {
  const Query query = queryAt(number);
  const float least = computeSeenPenalties(query);
  BestView best{least, least < kInfinity};
  std::ranges::fill(fallbackScale_, kInfinity);
  if (!needsFallbacks(least)) return best;
  for (size_t view = 0; view < penalty_.size(); ++view) {
    const auto [angle, scale] = fallbackOf(view, query);
    angle_[view] = angle;
    fallbackScale_[view] = scale;
    best.penalty = std::min(best.penalty, penalty(view, 0));
  }
  return best;
}

CameraWeights::Nearest CameraWeights::nearestOf(size_t number) {
  const Query query = queryAt(number);
  const float seeing = computeSeenPenalties(query);
  NearestCandidates nearest(count_);
  if (!needsFallbacks(seeing)) {
    for (uint32_t view = 0; view < penalty_.size(); ++view) nearest.offer({view, penalty_[view]});
    return {nearest, {seeing, true}};
  }
  for (uint32_t view = 0; view < penalty_.size(); ++view) {
    float penalty = penalty_[view];
    constexpr float kRounding = 1e-6f; // of the cosine
    const auto towards = viewpoints_[view].towards(query.p0);
    const float bound = leastFallbackPenalty(anglePenalty(towards.cast<float>(), query.towardsView),
                                             static_cast<float>(query.normal.dot(towards.raw())),
                                             query.visibility[view] > 0, kRounding);
    if (!(bound >= nearest.worst())) { // its exact penalty might be among the nearest
      const auto [angle, scale] = fallbackOf(view, query);
      penalty = std::min(penalty, fallbackPenalty(angle, scale));
    }
    nearest.offer({view, penalty});
  }
  const float least = nearest.sorted().empty() ? kInfinity : nearest.sorted()[0].penalty;
  return {nearest, {least, seeing < kInfinity}};
}

} // namespace surflect::weights
