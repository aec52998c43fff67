// Camera weights: the views that are blended for a surfel and a direction to the viewer.
//
//   p_i = (1 - cos theta_i) / s_i     r_i = (1 - p_i / p_t) / p_i     w_i = r_i / sum r
//
// Symbols: theta_i angle at the surfel between view i and the viewer, s_i visibility weight of view i at the
// surfel, p_i penalty, p_t threshold, r_i relevance, w_i weight.  [Weyrich 2005, §5.2; Buehler 2001, §4]
// Dividing by s_i lets a view fade out of the blend without a jump where the surfel becomes hidden or
// grazing, or leaves the view's image (visibility_weights.h). A surfel that no view sees well is shown by
// fallback views (fallback_view.h).
#pragma once

#include "srf/weights/fallback_view.h"
#include "srf/weights/nearest_sources.h"
#include "srf/weights/query.h"
#include "srf/weights/reflectance_field.h"

#include <algorithm>
#include <vector>

namespace surflect::weights {

// Best view of a query: the least penalty, and whether a view sees the surfel at all.
struct BestView {
  float penalty = kInfinity; // including fallback views
  bool isSeen = false;       // true if a view sees the surfel, not only fallbacks
};

// Computes the camera weights of one query after another. Has working memory of its own: use one object per
// thread.
class CameraWeights {
public:
  // Field and batch must outlive the weights.
  CameraWeights(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options);

  // Prepares the weights of up to kQueryLanes queries from `begin` on, in vector lanes.
  void prepare(size_t begin, size_t count);
  // Calls use(view, weight) for each blended view of the lane-th prepared query.
  template <class Use> BestView forEach(size_t lane, const Use& use) {
    if (isPrepared(lane)) {
      blends_->forEach(lane, use);
      return {blends_->penalty(lane), true};
    }
    const auto [weights, best] = blend(begin_ + lane);
    for (const auto& [view, weight] : weights) use(view, weight);
    return best;
  }

  // The views of least penalty for the lane-th prepared query, one more than are blended.
  struct Nearest {
    NearestCandidates views;
    BestView best;
  };
  Nearest nearest(size_t lane) {
    if (isPrepared(lane)) return {blends_->candidates(lane), {blends_->penalty(lane), true}};
    return nearestOf(begin_ + lane);
  }

  // Weights of one query, computed by a loop over all views.
  struct Blend {
    BlendSet weights;
    BestView best;
  };
  Blend blend(size_t query) {
    const auto [views, best] = nearestOf(query);
    return {truncated(ulrWeights(views), weightError_), best};
  }

  // Computes the penalties of all views for one query, as penalty() requires.
  BestView computePenalties(size_t query);
  // Penalty of a view and a light with penalty l >= 0: the lesser of p_i + l and the penalty of the view as a
  // fallback. Infinite if the view may not be used.
  float penalty(size_t view, float ofLight) const {
    const float own = penalty_[view] + ofLight;
    if (fallbackScale_[view] == kInfinity) return own;
    return std::min(own, fallbackPenalty(angle_[view] + ofLight, fallbackScale_[view]));
  }

private:
  // Inputs for one query, and for one view as a fallback.
  struct Query {
    Point3<AcquisitionSpace, double> p0;
    Vec3<double> normal;
    std::span<const uint8_t> visibility; // s_i, encoded
    Direction3<AcquisitionSpace> towardsView;
  };
  struct Fallback {
    // 1 - cos theta_i; scale of the penalty, infinite if the surfel projects outside the image.
    float angle, scale;
  };
  // True if the vector lanes hold the weights; else all views are rated in a loop.
  bool isPrepared(size_t lane) const {
    return !nearest_ && blends_->isPrecise(lane) && blends_->penalty(lane) <= kFallbackFrom;
  }
  Nearest nearestOf(size_t query); // by a loop over all views
  Query queryAt(size_t query) const;
  Fallback fallbackOf(size_t view, const Query& query) const;
  float computeSeenPenalties(const Query& query);
  bool needsFallbacks(float least) const {
    return least == kInfinity || (least > kFallbackFrom && !nearest_);
  }

  const ReflectanceField& field_;
  const QueryBatch& batch_;
  const size_t count_; // number of views blended
  const bool nearest_; // true if penalties are plain 1 - cos theta_i
  const float weightError_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  NearestViews nearestViews_;
  size_t begin_ = 0;
  const QueryBlends* blends_ = nullptr;
  // One per view, for the query of computePenalties. angle_ is set where fallbackScale_ is finite.
  std::vector<float> penalty_, angle_, fallbackScale_;
};

} // namespace surflect::weights
