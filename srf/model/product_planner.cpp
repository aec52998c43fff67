#include "srf/model/product_planner.h"

#include <algorithm>

namespace surflect::model {

namespace {

// The row of a query to what was captured under fixed illumination.
LightFolder::Row fixedLight(codec::LightRows& rows) {
  rows.add(0, {1, 1, 1});
  return {rows.lights.size() - 1, rows.lights.size()};
}

} // namespace

void ProductPlanner::plan(size_t begin, ShadingPlan& plan) {
  const bool isLit = !model_.rig.lights.empty(), showsBlends = !plan.cameraBlend.empty();
  for (size_t first = 0; first < plan.queries; first += ulr::kChoiceLanes) {
    const size_t count = std::min(ulr::kChoiceLanes, plan.queries - first);
    if (isLit) lights_.choose(begin + first, count, plan.rows);
    views_.choose(begin + first, count);
    for (size_t lane = 0; lane < count; ++lane) {
      const size_t target = first + lane;
      const LightFolder::Row row = isLit ? lights_.fold(lane, plan.rows) : fixedLight(plan.rows);
      if (isLit && showsBlends) plan.lightBlend[target] = lights_.blendColor();
      const auto place = model_.cloud.p0[batch_.surfels[begin + target]].cast<double>();
      const Sight sight = views_.forEach(lane, [&](uint32_t view, float weight) {
        ask(projectors_, place, {target, view, weight, row.begin, row.end}, plan);
        if (showsBlends) plan.cameraBlend[target] = plan.cameraBlend[target] + weight * viewColor_[view];
      });
      plan.confidence[target] = ulr::confidenceOf(sight.penalty);
      if (!sight.isSeen) ++plan.unseen;
    }
  }
}

} // namespace surflect::model
