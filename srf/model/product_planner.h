// Plans queries whose cameras are chosen apart from lights: all cameras hold the same lights, or there is one
// illumination alone.
#pragma once

#include "srf/model/light_folder.h"
#include "srf/model/plan_part.h"
#include "srf/model/view_chooser.h"

#include <span>
#include <vector>

namespace surflect {

// Plans one group of queries after the other; holds what it would otherwise allocate anew.
class ProductPlanner {
public:
  // All must outlive the planner.
  ProductPlanner(const Model& model, const LightCoverage& coverage, const QueryBatch& batch,
                 const ShadeOptions& options)
      : model_(model), batch_(batch), views_(model, batch, options), lights_(model, coverage, batch, options),
        viewColor_(indexColors(model.rig.views.size())) {}

  // The queries from `begin` to before `end`, whose targets, one each, begin at `target`; colors: one per
  // query.
  void plan(size_t begin, size_t end, size_t target, PlanPart& part, std::span<BlendColors> colors);

private:
  const Model& model_;
  const QueryBatch& batch_;
  ViewChooser views_;
  LightFolder lights_;
  std::vector<Rgb> viewColor_;
};

} // namespace surflect
