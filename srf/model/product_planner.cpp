#include "srf/model/product_planner.h"

#include <algorithm>

namespace surflect {

void ProductPlanner::plan(size_t begin, size_t end, size_t target, PlanPart& part,
                          std::span<BlendColors> colors) {
  const bool isLit = !model_.rig.lights.empty();
  for (size_t first = begin; first < end; first += kChoiceLanes) {
    const size_t count = std::min(kChoiceLanes, end - first);
    if (isLit) lights_.choose(first, count);
    views_.choose(first, count);
    for (size_t lane = 0; lane < count; ++lane) {
      const size_t query = first + lane;
      BlendColors& color = colors[query - begin];
      color = {};
      const size_t rowBegin = part.rows.size();
      if (isLit)
        color.lights = lights_.fold(lane, part.rows);
      else
        part.rows.push_back({0, {1, 1, 1}});
      const auto place = model_.cloud.p0[batch_.surfels[query]].cast<double>();
      const bool isSeen = views_.forEach(lane, [&](uint32_t view, float weight) {
        part.ask(model_, view, place, target + query - begin, weight, rowBegin, part.rows.size());
        color.cameras = color.cameras + weight * viewColor_[view];
      });
      if (!isSeen) ++part.unseen;
    }
  }
}

} // namespace surflect
