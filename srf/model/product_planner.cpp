#include "srf/model/product_planner.h"

#include <algorithm>

namespace surflect {

void ProductPlanner::plan(size_t begin, ShadingPlan& plan) {
  const bool isLit = !model_.rig.lights.empty(), showsBlends = !plan.cameraBlend.empty();
  for (size_t first = 0; first < plan.queries; first += kChoiceLanes) {
    const size_t count = std::min(kChoiceLanes, plan.queries - first);
    if (isLit) lights_.choose(begin + first, count);
    views_.choose(begin + first, count);
    for (size_t lane = 0; lane < count; ++lane) {
      const size_t target = first + lane, rowBegin = plan.rows.size();
      if (isLit)
        lights_.fold(lane, plan.rows);
      else
        plan.rows.push_back({0, {1, 1, 1}});
      if (isLit && showsBlends) plan.lightBlend[target] = lights_.blendColor();
      const auto place = model_.cloud.p0[batch_.surfels[begin + target]].cast<double>();
      const Sight sight = views_.forEach(lane, [&](uint32_t view, float weight) {
        ask(projectors_, place, {target, view, weight, rowBegin, plan.rows.size()}, plan);
        if (showsBlends) plan.cameraBlend[target] = plan.cameraBlend[target] + weight * viewColor_[view];
      });
      plan.confidence[target] = confidenceOf(sight.penalty);
      if (!sight.isSeen) ++plan.unseen;
    }
  }
}

} // namespace surflect
