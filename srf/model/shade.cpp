#include "srf/model/shade.h"

namespace surflect {

std::vector<Rgb> shade(const ShadingPlan& plan, BlockCache& cache, ShadingStats& stats,
                       const Progress& progress) {
  const auto targets =
      execute(plan.ops, plan.rows, plan.queries * plan.targetsPerQuery, cache, stats, progress);
  if (plan.targetsPerQuery == 1) return targets;
  std::vector<Rgb> radiance(plan.queries);
  for (size_t target = 0; target < targets.size(); ++target)
    radiance[target / plan.targetsPerQuery] = radiance[target / plan.targetsPerQuery] + targets[target];
  return radiance;
}

std::vector<Rgb> shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options,
                       BlockCache& cache, ShadingStats& stats, const Progress& progress) {
  return shade(planShading(model, batch, options, progress), cache, stats, progress);
}

} // namespace surflect
