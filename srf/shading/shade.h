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
  size_t unseen = 0, unmatchedShadows = 0;  // as in ShadingPlan
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

// Radiance of queries that are generated on demand, so that only those being shaded are in memory.
Shaded shade(const weights::ReflectanceField& field, size_t queries, const FillBatch& fill,
             const weights::ShadeOptions& options, codec::BlockCache& cache, ShadingStats& stats,
             const Progress& progress = {}, const ShadeLap& lap = {});

// Radiance of each query of a plan.
std::vector<Rgb> shade(const ShadingPlan& plan, codec::BlockCache& cache, ShadingStats& stats,
                       const Progress& progress = {});

} // namespace surflect::shading
