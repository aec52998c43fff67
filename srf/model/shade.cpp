#include "srf/model/shade.h"

#include "surfel/stopwatch.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

namespace surflect {

namespace {

// From targets, so many a query.
std::vector<Rgb> summed(std::vector<Rgb> targets, size_t perQuery) {
  if (perQuery == 1) return targets;
  std::vector<Rgb> radiance(targets.size() / perQuery);
  for (size_t target = 0; target < targets.size(); ++target)
    radiance[target / perQuery] = radiance[target / perQuery] + targets[target];
  return radiance;
}

void append(const std::vector<Rgb>& part, std::vector<Rgb>& all) {
  all.insert(all.end(), part.begin(), part.end());
}

} // namespace

std::vector<Rgb> shade(const ShadingPlan& plan, BlockCache& cache, ShadingStats& stats,
                       const Progress& progress, Simd simd) {
  return summed(execute(plan.ops, plan.rows, plan.targets(), cache, stats, progress, simd),
                plan.targetsPerQuery);
}

Shaded shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options, BlockCache& cache,
             ShadingStats& stats, const Progress& progress, const std::function<void(double)>& lap,
             size_t targetsAtOnce) {
  Shaded shaded;
  shaded.radiance.reserve(batch.size());
  ShadingPlanner planner(model, batch, options);
  ShadingQueue queue(cache, stats, progress, options.simd);
  const size_t perQuery = planner.targetsPerQuery(), atOnce = std::max(size_t{1}, targetsAtOnce / perQuery);
  size_t begin = 0;
  do { // once also where there are no queries: that takes time, too
    std::vector<const ShadingPlan*> plans(planner.split(begin, std::min(batch.size(), begin + atOnce)));
    queue.begin(plans.size());
    std::atomic<double> planning = 0, all = 0; // seconds
    tbb::parallel_for(size_t{0}, plans.size(), [&](size_t i) {
      progress.checkpoint();
      const Stopwatch watch;
      plans[i] = &planner.plan(i);
      planning += watch.seconds();
      queue.ask(i, {plans[i]->ops, plans[i]->rows, plans[i]->targets()});
      all += watch.seconds();
    });
    if (lap) lap(all > 0 ? planning / all : 1);
    append(summed(queue.finish(), perQuery), shaded.radiance);
    for (const ShadingPlan* plan : plans) {
      append(plan->cameraBlend, shaded.cameraBlend);
      append(plan->lightBlend, shaded.lightBlend);
      shaded.unseen += plan->unseen;
    }
    if (lap) lap(0);
    begin += atOnce;
  } while (begin < batch.size());
  return shaded;
}

} // namespace surflect
