// How ill each view of a model answers for a surfel: by its angle to the direction that is asked for, over
// how far it may be asked at all.
#pragma once

#include "srf/model/model.h"
#include "srf/ulr/choice_lanes.h"
#include "srf/ulr/fallback_view.h"
#include "srf/ulr/ulr.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace surflect::model {

// What directions to the views lead to.
std::vector<ulr::Source> sourcesOf(std::span<const capture::View> views);

// How well the views together see a surfel from a direction.
struct Sight {
  float penalty = std::numeric_limits<float>::infinity(); // of the best, if only as a stand-in
  bool isSeen = false;                                    // by any
};

// Rates one query after the other; holds what it would otherwise allocate anew.
class ViewPenalties {
public:
  // `nearest`: penalties are those of the angle alone, without any fading.
  ViewPenalties(const Model& model, bool nearest, Simd simd);

  // Penalty over fade of every view, so that a view which fades leaves the blend without a jump. Where none
  // is left that sees the surfel well, others stand in.
  Sight rate(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView);

  // The weights of the `count` best, of all views that rate would rate.
  struct Rated {
    ulr::BlendSet blend;
    Sight sight;
  };
  Rated blend(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView, size_t count);

  // Of a rated view with a light of the given penalty, or with all of them alike; infinite where it must not
  // be asked.
  float with(size_t view, float lightPenalty) const {
    const float own = penalty_[view] + lightPenalty;
    if (standInScale_[view] == std::numeric_limits<float>::infinity()) return own;
    return std::min(own, ulr::fallbackPenalty(anglePenalty_[view] + lightPenalty, standInScale_[view]));
  }

private:
  float penaltyOf(size_t view, const Point3<AcquisitionSpace, double>& p0, uint8_t fade,
                  const Direction3<AcquisitionSpace>& towardsView) const;
  float rateSeeing(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView);
  bool asksStandIns(float best) const {
    return best == std::numeric_limits<float>::infinity() || (best > ulr::kFallbackFrom && !nearest_);
  }

  class StandIns;

  const Model& model_;
  const bool nearest_;
  ulr::SourceLook look_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  // Per view, of the current query; the scale is infinite where the view does not stand in, and without it
  // the angle has no meaning.
  std::vector<float> penalty_, anglePenalty_, standInScale_;
};

} // namespace surflect::model
