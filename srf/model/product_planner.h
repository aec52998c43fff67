// Plans queries whose cameras are chosen apart from lights: all cameras hold the same lights, or there is one
// illumination alone.
#pragma once

#include "srf/model/light_folder.h"
#include "srf/model/planning.h"
#include "srf/model/view_chooser.h"

#include <vector>

namespace surflect::model {

// Plans one group of queries after the other; holds what it would otherwise allocate anew.
class ProductPlanner {
public:
  // All must outlive the planner.
  ProductPlanner(const Model& model, const ulr::LightCoverage& coverage, const QueryBatch& batch,
                 const ShadeOptions& options)
      : model_(model), batch_(batch), views_(model, batch, options), lights_(model, coverage, batch, options),
        projectors_(projectorsOf(model.rig.views)), viewColor_(indexColors(model.rig.views.size())) {}

  // As many queries as the plan has, from `begin` on; a target each.
  void plan(size_t begin, ShadingPlan& plan);

private:
  const Model& model_;
  const QueryBatch& batch_;
  ViewChooser views_;
  LightFolder lights_;
  ViewProjectors projectors_;
  std::vector<Rgb> viewColor_;
};

} // namespace surflect::model
