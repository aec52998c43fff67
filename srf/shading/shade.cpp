#include "srf/shading/shade.h"

#include "surfel/base/time.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

namespace surflect::shading {

namespace {

// Directions to lights that are in memory at a time, 24 bytes each.
constexpr size_t kLightsAtOnce = 1 << 22;

template <class T> void append(const std::vector<T>& part, std::vector<T>& all) {
  all.insert(all.end(), part.begin(), part.end());
}

// Plans and executes ranges of a batch in turn.
class Shading {
public:
  // The arguments must outlive this.
  Shading(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
          const weights::ShadeOptions& options, codec::BlockCache& cache, ShadingStats& stats,
          const Progress& progress, const ShadeLap& lap, const Kept& kept = {})
      : planner_(field, batch, options), queue_(cache, stats, progress), progress_(progress), lap_(lap),
        lights_(batch.lights), showsTargets_(options.showsTargets),
        kept_(planner_.canRelight() ? kept.plans : nullptr), relights_(kept_ && kept_->areComplete),
        queriesAtOnce_(
            wholeGroups(std::min(options.targetsAtOnce / planner_.targetsPerPlace() / options.placesPerQuery,
                                 kLightsAtOnce / std::max(size_t{1}, batch.lights)))) {
    if (kept_ && !relights_) kept_->plans.clear();
    if (kept.lookUps && planner_.canRelight() && kept.lookUps->begin(options, batch, field.cloud.size()))
      lookUps_ = kept.lookUps;
  }

  // After the last range.
  void finish() {
    if (kept_) kept_->areComplete = true;
  }

  size_t queriesAtOnce() const { return queriesAtOnce_; }
  size_t targetsPerPlace() const { return planner_.targetsPerPlace(); }

  void add(size_t begin, size_t end, Shaded& shaded) {
    const size_t perPlan = planner_.queriesPerPlan(), count = (end - begin + perPlan - 1) / perPlan;
    std::vector<ShadingPlan>& made = kept_ ? kept_->plans : plans_;
    if (made.size() < nextKept_ + count) made.resize(nextKept_ + count);
    const std::span plans(made.data() + nextKept_, count);
    rows_.resize(std::max(rows_.size(), count));
    const LentRows lent(plans, rows_);
    queue_.begin(count);
    std::atomic<double> planning = 0, all = 0; // seconds
    tbb::parallel_for(size_t{0}, count, [&](size_t i) {
      progress_.checkpoint();
      const Stopwatch watch;
      const size_t first = begin + i * perPlan;
      const size_t last = std::min(end, first + perPlan);
      if (relights_)
        planner_.relight(first, last, plans[i]);
      else if (lookUps_)
        planner_.planKept(first, last, plans[i], *lookUps_);
      else
        planner_.plan(first, last, plans[i]);
      planning += watch.seconds();
      queue_.emit(i, plans[i].part());
      all += watch.seconds();
    });
    if (lap_) lap_(all > 0 ? planning / all : 1);
    std::vector<Rgb> targets = queue_.finish();
    size_t first = 0; // target of the plan
    for (const ShadingPlan& plan : plans) {
      addOffsets(plan, std::span(targets).subspan(first, plan.targets()));
      first += plan.targets();
    }
    if (showsTargets_) append(targets, shaded.targets);
    size_t firstPlace = shaded.radiance.size();
    append(summed(std::move(targets), planner_.targetsPerPlace()), shaded.radiance);
    for (const ShadingPlan& plan : plans) {
      append(plan.confidence, shaded.confidence);
      append(plan.alpha, shaded.alpha);
      append(plan.cameraBlend, shaded.cameraBlend);
      append(plan.lightBlend, shaded.lightBlend);
      shaded.unseen += plan.unseen;
      shaded.unmatchedShadows += plan.unmatchedShadows;
      for (const uint32_t unmatched : plan.unmatchedAt)
        shaded.unmatchedAt.push_back(firstPlace * lights_ + unmatched);
      firstPlace += plan.places;
    }
    if (kept_) nextKept_ += count;
    if (lap_) lap_(0);
  }

private:
  // Lends plans the memory of light rows, which they do not keep; takes it back when it goes, also by an
  // exception.
  class LentRows {
  public:
    LentRows(std::span<ShadingPlan> plans, std::vector<weights::LightRows>& rows)
        : plans_(plans), rows_(rows) {
      swap();
    }
    LentRows(const LentRows&) = delete;
    LentRows& operator=(const LentRows&) = delete;
    ~LentRows() { swap(); }

  private:
    void swap() {
      for (size_t i = 0; i < plans_.size(); ++i) std::swap(plans_[i].rows, rows_[i]);
    }
    std::span<ShadingPlan> plans_;
    std::vector<weights::LightRows>& rows_;
  };

  // At most so many queries, but at least one group of four, which is not divided.
  static size_t wholeGroups(size_t queries) { return std::max(size_t{1}, queries / 4) * 4; }

  ShadingPlanner planner_;
  ShadingQueue queue_;
  const Progress& progress_;
  const ShadeLap& lap_;
  const size_t lights_;
  const bool showsTargets_;
  KeptPlans* const kept_; // null: plans are forgotten
  const bool relights_;
  KeptLookUps* lookUps_ = nullptr;
  size_t nextKept_ = 0; // the first kept plan of the next range
  size_t queriesAtOnce_;
  std::vector<ShadingPlan> plans_;       // with the memory of the largest range so far
  std::vector<weights::LightRows> rows_; // of the plans of a range, which do not keep them
};

} // namespace

std::vector<Rgb> summed(std::vector<Rgb> targets, size_t perPlace) {
  if (perPlace == 1) return targets;
  std::vector<Rgb> radiance(targets.size() / perPlace);
  for (size_t target = 0; target < targets.size(); ++target)
    radiance[target / perPlace] = radiance[target / perPlace] + targets[target];
  return radiance;
}

std::vector<Rgb> shade(const ShadingPlan& plan, codec::BlockCache& cache, ShadingStats& stats,
                       const Progress& progress) {
  std::vector<Rgb> targets = execute(plan.ops, plan.rows, plan.targets(), cache, stats, progress);
  addOffsets(plan, targets);
  return summed(std::move(targets), plan.targetsPerPlace);
}

Shaded shade(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
             const weights::ShadeOptions& options, codec::BlockCache& cache, ShadingStats& stats,
             const Progress& progress, const ShadeLap& lap) {
  Shaded shaded;
  shaded.radiance.reserve(batch.size());
  Shading shading(field, batch, options, cache, stats, progress, lap);
  size_t begin = 0;
  do { // also runs once without queries, to report its time
    const size_t end = std::min(batch.size(), begin + shading.queriesAtOnce());
    shading.add(begin, end, shaded);
    begin = end;
  } while (begin < batch.size());
  return shaded;
}

Shaded shade(const weights::ReflectanceField& field, size_t queries, const FillBatch& fill,
             const weights::ShadeOptions& options, codec::BlockCache& cache, ShadingStats& stats,
             const Progress& progress, const ShadeLap& lap, const Kept& kept) {
  Shaded shaded;
  shaded.radiance.reserve(queries);
  weights::QueryBatch batch;
  fill(0, 0, batch);
  Shading shading(field, batch, options, cache, stats, progress, lap, kept);
  if (options.showsTargets) shaded.targets.reserve(kept.places * shading.targetsPerPlace());
  if (lap) lap(1);
  size_t begin = 0;
  do {
    const size_t end = std::min(queries, begin + shading.queriesAtOnce());
    fill(begin, end, batch);
    shading.add(0, batch.size(), shaded);
    begin = end;
  } while (begin < queries);
  shading.finish();
  return shaded;
}

} // namespace surflect::shading
