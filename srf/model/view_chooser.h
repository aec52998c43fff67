// The views that are blended for a query, without regard to lights.
#pragma once

#include "srf/model/query_batch.h"
#include "srf/model/shading_plan.h"
#include "srf/model/view_penalties.h"
#include "srf/ulr/choice_lanes.h"

namespace surflect::model {

class ViewChooser {
public:
  // All must outlive the chooser.
  ViewChooser(const Model& model, const QueryBatch& batch, const ShadeOptions& options);

  // Chooses for the queries from `begin` on, 1..kChoiceLanes.
  void choose(size_t begin, size_t count);

  // use(view, weight) of each that is blended for the lane-th of them.
  template <class Use> Sight forEach(size_t lane, const Use& use) {
    if (!options_.nearest && blends_->isSure(lane) && blends_->penalty(lane) <= ulr::kFallbackFrom) {
      blends_->forEach(lane, use);
      return {blends_->penalty(lane), true};
    }
    const size_t query = begin_ + lane;
    const auto [blend, sight] =
        all_.blend(batch_.surfels[query], batch_.towardsView[query], options_.nearest ? 1 : options_.cameras);
    for (const auto& [view, weight] : blend) use(view, weight);
    return sight;
  }

private:
  const Model& model_;
  const QueryBatch& batch_;
  const ShadeOptions& options_;
  ViewPenalties all_; // where none sees a surfel well, and for the baseline
  ulr::ViewLanes lanes_;
  size_t begin_ = 0;
  const ulr::LaneBlends* blends_ = nullptr;
};

} // namespace surflect::model
