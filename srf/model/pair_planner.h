// Plans queries to a capture that is not a full product: cameras and lights are chosen together.
#pragma once

#include "srf/model/planning.h"
#include "srf/model/rig_lights.h"
#include "srf/model/shading_plan.h"
#include "srf/model/view_penalties.h"
#include "srf/ulr/light_extrapolation.h"

#include <vector>

namespace surflect::model {

// Plans one query after the other; holds what it would otherwise allocate anew.
class PairPlanner {
public:
  // All must outlive the planner.
  PairPlanner(const Model& model, const ulr::LightCoverage& coverage, const QueryBatch& batch,
              const ShadeOptions& options);

  // As many queries as the plan has, from `begin` on; a target for each light and environment of each.
  void plan(size_t begin, ShadingPlan& plan);

private:
  struct Pair {
    uint32_t view, column, light;
  };
  // The cameras and lights that were blended for a query, in colours of their own.
  struct BlendColors {
    Rgb cameras, lights;
  };

  BlendColors planQuery(size_t query, size_t target, ShadingPlan& plan);
  void planEnvironment(size_t query, size_t e, size_t target, ShadingPlan& plan, BlendColors& colors);
  float rate(const Direction3<AcquisitionSpace>& towards, ulr::LightExtrapolation extrapolation);
  ulr::BlendSet blend() const;
  Pair placeOf(uint32_t pair) const;

  const Model& model_;
  const ulr::LightCoverage& coverage_;
  const QueryBatch& batch_;
  const ShadeOptions& options_;
  ViewPenalties views_; // of the current query
  RigLights lights_;
  ViewProjectors projectors_;
  std::vector<Rgb> viewColor_, lightColor_;
  std::vector<float> environmentBrightness_;
  std::vector<float> lightPenalty_; // per light of the rig, of the current direction
  std::vector<size_t> firstPair_;   // per view; the pairs of a view are its columns
  size_t pairs_ = 0;
  std::vector<Rgb> pairShare_; // per pair, what it takes over of an environment
  Point3<AcquisitionSpace, double> place_;
};

} // namespace surflect::model
