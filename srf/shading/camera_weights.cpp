#include "srf/shading/camera_weights.h"

#include "srf/ulr/weight_truncation.h"

#include <array>

namespace surflect::shading {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::vector<capture::Viewpoint<AcquisitionSpace>> viewpointsOf(std::span<const capture::View> views) {
  std::vector<capture::Viewpoint<AcquisitionSpace>> all;
  for (const capture::View& view : views) all.emplace_back(view.camera);
  return all;
}

} // namespace

CameraWeights::CameraWeights(const ReflectanceField& field, const QueryBatch& batch,
                             const ShadeOptions& options)
    : field_(field), batch_(batch), count_(options.nearest ? 1 : options.cameras), nearest_(options.nearest),
      weightError_(options.weightError), viewpoints_(viewpointsOf(field.rig.views)),
      angles_(ulr::sourcesOf(viewpoints_)),
      nearestViews_(ulr::sourcesOf(viewpoints_), field.visibility, options.weightError),
      penalty_(viewpoints_.size()), angle_(penalty_), fallbackScale_(penalty_) {}

void CameraWeights::prepare(size_t begin, size_t count) {
  begin_ = begin;
  if (nearest_) return;
  std::array<Point3<AcquisitionSpace>, ulr::kQueryLanes> places;
  const std::span surfels(batch_.surfels.data() + begin, count);
  for (size_t lane = 0; lane < count; ++lane) places[lane] = field_.cloud.p0[surfels[lane]];
  blends_ = &nearestViews_.blend(surfels, {places.data(), count}, {batch_.towardsView.data() + begin, count},
                                 count_);
  const size_t next = begin + count, ahead = std::min(ulr::kQueryLanes, batch_.surfels.size() - next);
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
  return {ulr::anglePenalty(towards.cast<float>(), query.towardsView),
          isInImage
              ? ulr::fallbackScale(query.normal.dot(towards.raw()), ulr::borderFade(camera.lens, *pixel),
                                   ulr::VisibilityWeights::decode(query.visibility[view]))
              : kInfinity};
}

// Computes p_i of all views that see the surfel, and infinity for the others; returns the least.
float CameraWeights::computeSeenPenalties(const Query& query) {
  float least = kInfinity;
  for (size_t view = 0; view < penalty_.size(); ++view) {
    penalty_[view] = kInfinity;
    if (query.visibility[view] == 0) continue;
    const float angle =
        ulr::anglePenalty(viewpoints_[view].towards(query.p0).cast<float>(), query.towardsView);
    penalty_[view] = nearest_ ? angle : angle / ulr::VisibilityWeights::decode(query.visibility[view]);
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

ulr::BlendSet CameraWeights::truncatedWeights(const ulr::NearestCandidates& nearest) const {
  ulr::BlendSet weights = ulr::ulrWeights(nearest);
  ulr::truncate(weights, weightError_);
  return weights;
}

CameraWeights::Nearest CameraWeights::nearestOf(size_t number) {
  const Query query = queryAt(number);
  const float seeing = computeSeenPenalties(query);
  ulr::NearestCandidates nearest(count_);
  if (!needsFallbacks(seeing)) {
    for (uint32_t view = 0; view < penalty_.size(); ++view) nearest.offer({view, penalty_[view]});
    return {nearest, {seeing, true}};
  }
  const auto normal = assume<Normal3<AcquisitionSpace>>(query.normal);
  angles_.compute(field_.cloud.p0[batch_.surfels[number]], query.towardsView, normal);
  const auto angles = angles_.penalties(), cosines = angles_.cosines();
  for (uint32_t view = 0; view < penalty_.size(); ++view) {
    float penalty = penalty_[view];
    const float bound = ulr::leastFallbackPenalty(angles[view], cosines[view], query.visibility[view] > 0,
                                                  ulr::SourcePenalties::kError);
    if (!(bound >= nearest.worst())) { // its exact penalty might be among the nearest
      const auto [angle, scale] = fallbackOf(view, query);
      penalty = std::min(penalty, ulr::fallbackPenalty(angle, scale));
    }
    nearest.offer({view, penalty});
  }
  const float least = nearest.sorted().empty() ? kInfinity : nearest.sorted()[0].penalty;
  return {nearest, {least, seeing < kInfinity}};
}

} // namespace surflect::shading
