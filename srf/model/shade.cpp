#include "srf/model/shade.h"

#include <algorithm>

namespace surflect {

std::vector<Rgb> shade(std::span<const ShadingPlan> plans, BlockCache& cache, ShadingStats& stats,
                       const Progress& progress, Simd simd) {
  std::vector<ShadingPart> parts;
  for (const ShadingPlan& plan : plans) parts.push_back({plan.ops, plan.rows, plan.targets()});
  std::vector<Rgb> targets = execute(parts, cache, stats, progress, simd);
  const size_t perQuery = plans.empty() ? 1 : plans[0].targetsPerQuery;
  if (perQuery == 1) return targets;
  std::vector<Rgb> radiance(targets.size() / perQuery);
  for (size_t target = 0; target < targets.size(); ++target)
    radiance[target / perQuery] = radiance[target / perQuery] + targets[target];
  return radiance;
}

Shaded shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options, BlockCache& cache,
             ShadingStats& stats, const Progress& progress,
             const std::function<void(std::string_view)>& finished, size_t targetsAtOnce) {
  const auto finish = [&](std::string_view stage) {
    if (finished) finished(stage);
  };
  Shaded shaded;
  shaded.radiance.reserve(batch.size());
  const auto append = [](std::vector<Rgb>& all, const std::vector<Rgb>& part) {
    all.insert(all.end(), part.begin(), part.end());
  };
  ShadingPlanner planner(model, batch, options);
  const size_t atOnce = std::max(size_t{1}, targetsAtOnce / planner.targetsPerQuery());
  size_t begin = 0;
  do { // once also where there are no queries: that takes time, too
    const auto plans = planner.plan(begin, std::min(batch.size(), begin + atOnce), progress);
    for (const ShadingPlan& plan : plans) {
      append(shaded.cameraBlend, plan.cameraBlend);
      append(shaded.lightBlend, plan.lightBlend);
      shaded.unseen += plan.unseen;
    }
    finish("ulr");
    append(shaded.radiance, shade(plans, cache, stats, progress, options.simd));
    finish("shade");
    begin += atOnce;
  } while (begin < batch.size());
  return shaded;
}

} // namespace surflect
