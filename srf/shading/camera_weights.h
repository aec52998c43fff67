// Weights of cameras: which views are blended for a surfel and a direction to the viewer.
//
//   p_i = (1 - cos theta_i) / s_i     r_i = (1 - p_i / p_t) / p_i     w_i = r_i / sum r
//
// Symbols: theta_i angle at the surfel between view i and the viewer, s_i visibility weight of view i at the
// surfel, p_i penalty, p_t threshold, r_i relevance, w_i weight.  [Weyrich 2005, §5.2; Buehler 2001, §4]
// Dividing by s_i lets a view that becomes hidden, grazing or leaves its image fade out of the blend without
// a jump (visibility_weights.h). A surfel that no view sees well is answered by fallback views
// (fallback_view.h).
#pragma once

#include "srf/shading/query.h"
#include "srf/shading/reflectance_field.h"
#include "srf/ulr/fallback_view.h"
#include "srf/ulr/nearest_sources.h"
#include "srf/ulr/ulr.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace surflect::shading {

// How well the views together see a surfel from a direction.
struct Sight {
  float penalty = std::numeric_limits<float>::infinity(); // the least, of fallback views too
  bool isSeen = false;                                    // by any view that is not a fallback
};

// Computes weights for one query after another, in memory of its own: one object a thread.
class CameraWeights {
public:
  // Field and batch must outlive the weights.
  CameraWeights(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options);

  // Weights of up to kQueryLanes queries from `begin` on, in vector lanes.
  void prepare(size_t begin, size_t count);
  // use(view, weight) for each view that is blended for the lane-th of the prepared queries.
  template <class Use> Sight forEach(size_t lane, const Use& use) {
    if (!nearest_ && blends_->isPrecise(lane) && blends_->penalty(lane) <= ulr::kFallbackFrom) {
      blends_->forEach(lane, use);
      return {blends_->penalty(lane), true};
    }
    const auto [weights, sight] = blend(begin_ + lane);
    for (const auto& [view, weight] : weights) use(view, weight);
    return sight;
  }

  // The weights of one query, by a loop over all views.
  struct Blend {
    ulr::BlendSet weights;
    Sight sight;
  };
  Blend blend(size_t query);

  // Computes the penalties of all views for one query; then penalty() may be asked.
  Sight ratePenalties(size_t query);
  // The penalty of a view together with that of a light, l >= 0: p_i + l, or that of the fallback if less.
  // Infinite where the view must not be asked.
  float penalty(size_t view, float ofLight) const {
    const float own = penalty_[view] + ofLight;
    if (fallbackScale_[view] == std::numeric_limits<float>::infinity()) return own;
    return std::min(own, ulr::fallbackPenalty(angle_[view] + ofLight, fallbackScale_[view]));
  }

private:
  // The query as seen by the views, and a view as its fallback.
  struct Query {
    Point3<AcquisitionSpace, double> p0;
    Vec3<double> normal;
    std::span<const uint8_t> fades; // s_i, encoded
    Direction3<AcquisitionSpace> towardsView;
  };
  struct Fallback {
    float angle, scale; // 1 - cos theta_i; scale of its penalty, infinite where the surfel is off the image
  };
  Query queryAt(size_t query) const;
  Fallback fallbackOf(size_t view, const Query& query) const;
  float rateSeeing(const Query& query);
  bool needsFallbacks(float least) const {
    return least == std::numeric_limits<float>::infinity() || (least > ulr::kFallbackFrom && !nearest_);
  }

  const ReflectanceField& field_;
  const QueryBatch& batch_;
  const size_t count_; // views blended
  const bool nearest_; // penalties are 1 - cos theta_i alone
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  ulr::SourceAngles angles_;
  ulr::NearestViews nearestViews_;
  size_t begin_ = 0;
  const ulr::QueryBlends* blends_ = nullptr;
  // Per view, for the query of ratePenalties. angle_ is set where fallbackScale_ is finite.
  std::vector<float> penalty_, angle_, fallbackScale_;
};

} // namespace surflect::shading
