#include "srf/model/shade.h"

#include "surfel/base/stopwatch.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

namespace surflect::model {

namespace {

// From targets, so many a query.
std::vector<Rgb> summed(std::vector<Rgb> targets, size_t perQuery) {
  if (perQuery == 1) return targets;
  std::vector<Rgb> radiance(targets.size() / perQuery);
  for (size_t target = 0; target < targets.size(); ++target)
    radiance[target / perQuery] = radiance[target / perQuery] + targets[target];
  return radiance;
}

template <class T> void append(const std::vector<T>& part, std::vector<T>& all) {
  all.insert(all.end(), part.begin(), part.end());
}

// Answers the queries of a batch, some after the others.
class Shading {
public:
  // All must outlive this.
  Shading(const Model& model, const QueryBatch& batch, const ShadeOptions& options, codec::BlockCache& cache,
          codec::ShadingStats& stats, const Progress& progress, const std::function<void(double)>& lap)
      : planner_(model, batch, options), queue_(cache, stats, progress, options.simd), progress_(progress),
        lap_(lap) {}

  size_t queriesFor(size_t targets) const {
    return std::max(size_t{1}, targets / planner_.targetsPerQuery());
  }

  void add(size_t begin, size_t end, Shaded& shaded) {
    std::vector<const ShadingPlan*> plans(planner_.split(begin, end));
    queue_.begin(plans.size());
    std::atomic<double> planning = 0, all = 0; // seconds
    tbb::parallel_for(size_t{0}, plans.size(), [&](size_t i) {
      progress_.checkpoint();
      const Stopwatch watch;
      plans[i] = &planner_.plan(i);
      planning += watch.seconds();
      queue_.ask(i, {plans[i]->ops, &plans[i]->rows, plans[i]->targets()});
      all += watch.seconds();
    });
    if (lap_) lap_(all > 0 ? planning / all : 1);
    append(summed(queue_.finish(), planner_.targetsPerQuery()), shaded.radiance);
    for (const ShadingPlan* plan : plans) {
      append(plan->confidence, shaded.confidence);
      append(plan->cameraBlend, shaded.cameraBlend);
      append(plan->lightBlend, shaded.lightBlend);
      shaded.unseen += plan->unseen;
    }
    if (lap_) lap_(0);
  }

private:
  ShadingPlanner planner_;
  codec::ShadingQueue queue_;
  const Progress& progress_;
  const std::function<void(double)>& lap_;
};

} // namespace

std::vector<Rgb> shade(const ShadingPlan& plan, codec::BlockCache& cache, codec::ShadingStats& stats,
                       const Progress& progress, Simd simd) {
  return summed(codec::execute(plan.ops, plan.rows, plan.targets(), cache, stats, progress, simd),
                plan.targetsPerQuery);
}

Shaded shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options,
             codec::BlockCache& cache, codec::ShadingStats& stats, const Progress& progress,
             const std::function<void(double)>& lap) {
  Shaded shaded;
  shaded.radiance.reserve(batch.size());
  Shading shading(model, batch, options, cache, stats, progress, lap);
  const size_t atOnce = shading.queriesFor(options.targetsAtOnce);
  size_t begin = 0;
  do { // once also where there are no queries: that takes time, too
    shading.add(begin, std::min(batch.size(), begin + atOnce), shaded);
    begin += atOnce;
  } while (begin < batch.size());
  return shaded;
}

Shaded shade(const Model& model, size_t queries, const FillBatch& fill, const ShadeOptions& options,
             codec::BlockCache& cache, codec::ShadingStats& stats, const Progress& progress,
             const std::function<void(double)>& lap) {
  Shaded shaded;
  shaded.radiance.reserve(queries);
  QueryBatch batch;
  fill(0, 0, batch); // for its lights
  Shading shading(model, batch, options, cache, stats, progress, lap);
  if (lap) lap(1);
  const size_t atOnce = shading.queriesFor(options.targetsAtOnce);
  size_t begin = 0;
  do {
    fill(begin, std::min(queries, begin + atOnce), batch);
    shading.add(0, batch.size(), shaded);
    begin += atOnce;
  } while (begin < queries);
  return shaded;
}

} // namespace surflect::model
