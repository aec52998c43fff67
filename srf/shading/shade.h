// The door of srf/: queries in acquisition space go in, radiance comes out.
#pragma once

#include "srf/shading/plan.h"
#include "srf/shading/queue.h"

#include <functional>
#include <vector>

namespace surflect::shading {

struct Shaded {
  std::vector<Rgb> radiance;                // per query
  std::vector<float> confidence;            // per query, as ShadingPlan has it
  std::vector<Rgb> cameraBlend, lightBlend; // likewise
  size_t unseen = 0;                        // queries that are answered by fallback views alone
};

// Told of the processors' time since the last call: the share of planning, 0..1; the rest is look-ups.
using ShadeLap = std::function<void(double planningShare)>;

// Radiance per query. Each plan is made and looked up by one thread, so that what passes between the two
// stays in its caches. Blocks are fetched for options.targetsAtOnce targets at a time; one that is needed
// again later is read again where the cache does not keep it. Throws Error as ShadingPlanner and
// ViewFile::read.
Shaded shade(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options,
             codec::BlockCache& cache, ShadingStats& stats, const Progress& progress = {},
             const ShadeLap& lap = {});

// Writes the queries [begin, end) to a batch, in its memory. Lights and environments are the same for all
// ranges; the first call, for an empty range, is for these alone.
using FillBatch = std::function<void(size_t begin, size_t end, QueryBatch& batch)>;

// Radiance of queries that are made when they are due: no more of them are in memory than are shaded at once.
Shaded shade(const ReflectanceField& field, size_t queries, const FillBatch& fill,
             const ShadeOptions& options, codec::BlockCache& cache, ShadingStats& stats,
             const Progress& progress = {}, const ShadeLap& lap = {});

// Radiance per query of a plan.
std::vector<Rgb> shade(const ShadingPlan& plan, codec::BlockCache& cache, ShadingStats& stats,
                       const Progress& progress = {});

} // namespace surflect::shading
