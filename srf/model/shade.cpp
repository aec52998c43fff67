#include "srf/model/shade.h"

#include <algorithm>

namespace surflect {

std::vector<Rgb> shade(const ShadingPlan& plan, BlockCache& cache, ShadingStats& stats,
                       const Progress& progress, Simd simd) {
  const auto targets =
      execute(plan.ops, plan.rows, plan.queries * plan.targetsPerQuery, cache, stats, progress, simd);
  if (plan.targetsPerQuery == 1) return targets;
  std::vector<Rgb> radiance(plan.queries);
  for (size_t target = 0; target < targets.size(); ++target)
    radiance[target / plan.targetsPerQuery] = radiance[target / plan.targetsPerQuery] + targets[target];
  return radiance;
}

Shaded shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options, BlockCache& cache,
             ShadingStats& stats, const Progress& progress,
             const std::function<void(std::string_view)>& finished, size_t targetsAtOnce) {
  const auto finish = [&](std::string_view stage) {
    if (finished) finished(stage);
  };
  Shaded shaded;
  for (auto* values : {&shaded.radiance, &shaded.cameraBlend, &shaded.lightBlend})
    values->reserve(batch.size());
  const auto append = [](std::vector<Rgb>& all, const std::vector<Rgb>& part) {
    all.insert(all.end(), part.begin(), part.end());
  };
  ShadingPlanner planner(model, batch, options);
  const size_t atOnce = std::max(size_t{1}, targetsAtOnce / planner.targetsPerQuery());
  size_t begin = 0;
  do { // once also where there are no queries: that takes time, too
    const ShadingPlan& plan = planner.plan(begin, std::min(batch.size(), begin + atOnce), progress);
    append(shaded.cameraBlend, plan.cameraBlend);
    append(shaded.lightBlend, plan.lightBlend);
    shaded.unseen += plan.unseen;
    finish("ulr");
    append(shaded.radiance, shade(plan, cache, stats, progress, options.simd));
    finish("shade");
    begin += atOnce;
  } while (begin < batch.size());
  return shaded;
}

} // namespace surflect
