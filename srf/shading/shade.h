// Shades queries: the interface of srf/ to renderers. Queries are in acquisition space.
#pragma once

#include "srf/shading/plan.h"
#include "srf/shading/queue.h"

#include <functional>
#include <vector>

namespace surflect::shading {

struct Shaded {
  std::vector<Rgb> radiance;                // per place; premultiplied by alpha
  std::vector<float> alpha;                 // per place, as in ShadingPlan
  std::vector<float> confidence;            // per place, as in ShadingPlan
  std::vector<Rgb> cameraBlend, lightBlend; // per place, as in ShadingPlan
  size_t unseen = 0;                        // as in ShadingPlan
  size_t unmatchedShadows = 0;              // as in ShadingPlan
  // Radiance of each target, those of a place in succession, if the options show targets.
  std::vector<Rgb> targets;
  std::vector<size_t> unmatchedAt; // likewise, as in ShadingPlan
};

// Sum of the radiance of each place's targets.
std::vector<Rgb> summed(std::vector<Rgb> targets, size_t perPlace);

// Plans of one call of shade() that a later call takes over, for queries that differ in nothing but the
// directions and irradiance of their lights: see ShadingPlanner::relight. At least 28 bytes for each blended
// camera of a query, up to twice that while plans grow.
struct KeptPlans {
  std::vector<ShadingPlan> plans;
  bool areComplete = false; // true: the next call relights them; false: it makes them
};

// Called with the share of planning, 0..1, in the processor time since its last call; look-ups took the rest.
using ShadeLap = std::function<void(double planningShare)>;

// Returns the radiance of each query. Each plan is made and executed by one thread, so that it stays in the
// thread's caches. Blocks are fetched for options.targetsAtOnce targets at a time; a block needed again later
// is read again unless the cache has kept it. Throws Error as ShadingPlanner and ViewFile::read.
Shaded shade(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
             const weights::ShadeOptions& options, codec::BlockCache& cache, ShadingStats& stats,
             const Progress& progress = {}, const ShadeLap& lap = {});

// Fills a batch with the queries [begin, end), reusing its memory. The first call has an empty range and
// provides only the lights and environments, which must be the same for all ranges. Ranges have whole groups
// of four, but for the last one without corners.
using FillBatch = std::function<void(size_t begin, size_t end, weights::QueryBatch& batch)>;

// Stages that a call leaves for the next one, where cameras and lights are weighted apart. Null: nothing.
struct Kept {
  KeptPlans* plans = nullptr;
  KeptLookUps* lookUps = nullptr; // without plans, environments and blend colours
  size_t places = 0;              // of all queries, to make room for targets; may be unknown
};

// Radiance of queries that are generated on demand, so that only those being shaded are in memory.
Shaded shade(const weights::ReflectanceField& field, size_t queries, const FillBatch& fill,
             const weights::ShadeOptions& options, codec::BlockCache& cache, ShadingStats& stats,
             const Progress& progress = {}, const ShadeLap& lap = {}, const Kept& kept = {});

// Radiance of each query of a plan.
std::vector<Rgb> shade(const ShadingPlan& plan, codec::BlockCache& cache, ShadingStats& stats,
                       const Progress& progress = {});

} // namespace surflect::shading
