// Plans queries to a capture that is not a full product: cameras and lights are chosen together.
#pragma once

#include "srf/model/plan_part.h"
#include "srf/model/rig_lights.h"
#include "srf/model/shading_plan.h"
#include "srf/model/view_penalties.h"
#include "srf/query/light_coverage.h"

#include <span>
#include <vector>

namespace surflect {

// Plans one query after the other; holds what it would otherwise allocate anew.
class PairPlanner {
public:
  // All must outlive the planner.
  PairPlanner(const Model& model, const LightCoverage& coverage, const QueryBatch& batch,
              const ShadeOptions& options);

  // The queries from `begin` to before `end`, whose targets, one per light and environment each, begin at
  // `target`; colors: one per query.
  void plan(size_t begin, size_t end, size_t target, PlanPart& part, std::span<BlendColors> colors);

private:
  struct Pair {
    uint32_t view, column, light;
  };

  void planQuery(size_t query, size_t target, PlanPart& part, BlendColors& colors);
  void planEnvironment(size_t query, size_t e, size_t target, PlanPart& part, BlendColors& colors);
  float rate(const Direction3<AcquisitionSpace>& towards, Uncovered uncovered);
  BlendSet blend() const;
  Pair placeOf(uint32_t pair) const;

  const Model& model_;
  const LightCoverage& coverage_;
  const QueryBatch& batch_;
  const ShadeOptions& options_;
  ViewPenalties views_; // of the current query
  RigLights lights_;
  std::vector<Rgb> viewColor_, lightColor_;
  std::vector<float> environmentBrightness_;
  std::vector<float> lightPenalty_; // per light of the rig, of the current direction
  std::vector<size_t> firstPair_;   // per view; the pairs of a view are its columns
  size_t pairs_ = 0;
  std::vector<Rgb> pairShare_; // per pair, what it takes over of an environment
  Point3<AcquisitionSpace, double> place_;
};

} // namespace surflect
